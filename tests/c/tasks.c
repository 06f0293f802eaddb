/* Threads of the host that help with the steps: the same bits, whatever these threads do. */
#include "check.h"

#include <pthread.h>

/* What the host knows of a task: a thread of its own. */
typedef struct job {
    pthread_t thread;
    isocoat_task_fn run;
    void *task;
} job;

typedef struct host {
    isocoat_world *world;
    int enqueued, finished, refused, most;
    bool at_once;
} host;

static void *run_job(void *argument)
{
    job *all = (job *)argument;
    all->run(all->task);
    return NULL;
}

static void *enqueue(void *context, isocoat_task_fn run, void *task)
{
    host *all = (host *)context;
    job *made;
    isocoat_counters counters = isocoat_counters_default();
    REFUSED(isocoat_world_get_counters(all->world, &counters), ISOCOAT_ERROR_LOCKED, "being stepped");
    if (all->at_once) {
        run(task);
        ++all->enqueued;
        return all;
    }
    if (all->enqueued - all->finished >= all->most) {
        ++all->refused;
        return NULL;
    }
    made = (job *)malloc(sizeof *made);
    if (made == NULL) return NULL;
    made->run = run;
    made->task = task;
    if (pthread_create(&made->thread, NULL, run_job, made) != 0) {
        free(made);
        return NULL;
    }
    ++all->enqueued;
    return made;
}

static void finish(void *context, void *handle)
{
    host *all = (host *)context;
    ++all->finished;
    if (!all->at_once) {
        pthread_join(((job *)handle)->thread, NULL);
        free(handle);
    }
}

#define BALLS 40

/* Balls in a heap; their states after some steps. */
static void heap(uint32_t workers, host *all, isocoat_link_state states[BALLS])
{
    isocoat_world_desc desc = isocoat_world_desc_default();
    isocoat_world *world = NULL;
    isocoat_link links[BALLS];
    int i;
    desc.gravity[2] = -9.8;
    desc.response = ISOCOAT_RESPONSE_IMPLICIT;
    OK(isocoat_world_create(&desc, &world));
    new_ball(world, ISOCOAT_LINK_FIXED, 0.0);
    for (i = 0; i < BALLS; ++i) {
        isocoat_link_state state;
        links[i] = new_ball(world, ISOCOAT_LINK_RIGID, 0.19 + 0.19 * (i / 4)).link;
        OK(isocoat_link_get_state(world, links[i], &state));
        state.pose.position[0] = 0.15 * (i % 2) - 0.07;
        state.pose.position[1] = 0.15 * (i / 2 % 2) - 0.08;
        OK(isocoat_link_set_state(world, links[i], &state));
    }
    if (all != NULL) {
        all->world = world;
        OK(isocoat_world_set_tasks(world, workers, enqueue, finish, all));
    }
    for (i = 0; i < 10; ++i) OK(isocoat_world_step(world, 1.0 / 120.0));
    for (i = 0; i < BALLS; ++i) OK(isocoat_link_get_state(world, links[i], &states[i]));
    if (all != NULL) {
        const int enqueued = all->enqueued;
        OK(isocoat_world_set_tasks(world, 1, NULL, NULL, NULL));
        OK(isocoat_world_step(world, 1.0 / 120.0));
        CHECK(all->enqueued == enqueued && all->finished == enqueued);
    }
    isocoat_world_destroy(world);
}

static void any_number_of_workers_gives_the_same_bits(void)
{
    isocoat_link_state alone[BALLS], helped[BALLS];
    uint32_t workers;
    heap(1, NULL, alone);
    for (workers = 1; workers <= 8; workers *= 2) {
        host all;
        memset(&all, 0, sizeof all);
        all.most = 64;
        heap(workers, &all, helped);
        CHECK(memcmp(alone, helped, sizeof alone) == 0);
        CHECK(all.enqueued == 10 * ((int)workers - 1) && all.refused == 0);
    }
}

static void a_host_that_refuses_or_works_at_once_changes_nothing(void)
{
    isocoat_link_state alone[BALLS], helped[BALLS];
    host all;
    heap(1, NULL, alone);
    memset(&all, 0, sizeof all);
    all.most = 1;
    heap(4, &all, helped);
    CHECK(memcmp(alone, helped, sizeof alone) == 0);
    /* After a refusal nothing more is offered in that step. */
    CHECK(all.enqueued == 10 && all.refused == 10);
    memset(&all, 0, sizeof all);
    all.at_once = true;
    heap(4, &all, helped);
    CHECK(memcmp(alone, helped, sizeof alone) == 0);
    CHECK(all.enqueued == 30);
}

static void bad_settings_are_refused(void)
{
    isocoat_world *world = new_world();
    REFUSED(isocoat_world_set_tasks(world, 0, enqueue, finish, NULL), ISOCOAT_ERROR_OUT_OF_RANGE,
            "worker_count is 0; must be from 1 to 64");
    REFUSED(isocoat_world_set_tasks(world, 65, NULL, NULL, NULL), ISOCOAT_ERROR_OUT_OF_RANGE, "worker_count is 65");
    REFUSED(isocoat_world_set_tasks(world, 2, NULL, finish, NULL), ISOCOAT_ERROR_INVALID_ARGUMENT, "enqueue is NULL");
    REFUSED(isocoat_world_set_tasks(world, 2, enqueue, NULL, NULL), ISOCOAT_ERROR_INVALID_ARGUMENT, "finish is NULL");
    REFUSED(isocoat_world_set_tasks(NULL, 2, enqueue, finish, NULL), ISOCOAT_ERROR_INVALID_ARGUMENT, "world is NULL");
    isocoat_world_destroy(world);
}

int main(void)
{
    any_number_of_workers_gives_the_same_bits();
    a_host_that_refuses_or_works_at_once_changes_nothing();
    bad_settings_are_refused();
    return verdict("tasks");
}
