#include "host.h"

int main(int argc, char **argv) { return run_host(argc, argv); }
