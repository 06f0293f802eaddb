//! What a step says at its end: contacts and events.

use super::events::{Contact, Event, EventKind};
use super::step::Stepping;
use super::{BodyId, World};
use crate::contact::candidate::Candidate;
use crate::contact::pair::Side;
use crate::contact::patch::Sums;
use crate::math::Vec3;
use crate::team::Team;

/// What is to be said of a candidate at the end of a step.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Conclusion {
    contacts: usize,
    begins: bool,
    ends: bool,
    overloads: bool,
}

impl Conclusion {
    /// What happened, noted in the candidate's memory too.
    fn of(candidate: &mut Candidate, implicit: bool) -> Self {
        let overloaded = !candidate.surface.overloads.is_empty();
        let contacts = candidate.pressing().count() + candidate.push_outs().count();
        let touching = contacts > 0 || overloaded;
        let held = if implicit { 0.0 } else { candidate.elastic_energy() };
        let memory = &mut candidate.memory;
        // It may have come and gone within the step.
        let passed = !memory.touching && !touching && memory.touched;
        let conclusion = Self {
            contacts,
            begins: !memory.touching && touching || passed,
            ends: memory.touching && !touching || passed,
            overloads: memory.overloaded && !memory.was_overloaded,
        };
        (memory.touching, memory.held) = (touching, held);
        memory.was_overloaded = overloaded || memory.overloaded && touching;
        memory.overloaded = false;
        conclusion
    }
}

impl World {
    /// Contacts and events. What sleeps is at the front of the contacts.
    pub(super) fn report(&mut self, state: &mut Stepping, team: &Team) {
        self.keep_resting_contacts(state);
        let Stepping { candidates, gone, spare, events, contacts, conclusions, contact_ends, .. } = state;
        let (islands, owners) = (&state.islands, &state.owners);
        events.clear();
        // Pairs that are no longer candidates cannot touch.
        for mut gone in gone.drain(..) {
            if gone.memory.touching {
                let bodies = gone.memory.ids.map(BodyId::from_raw);
                events.push(Event { kind: EventKind::End, bodies });
            }
            gone.memory.forget();
            spare.push(gone);
        }
        conclusions.resize(candidates.len(), Conclusion::default());
        team.each_row(candidates, 1, conclusions, |index, candidates, conclusion| {
            let implicit = islands[owners[index] as usize].outcome.rounds > 0;
            *conclusion = Conclusion::of(&mut candidates[0], implicit);
        });
        let candidates = &*candidates;
        let mut end = 0;
        contact_ends.clear();
        for (candidate, Conclusion { contacts, begins, ends, overloads }) in candidates.iter().zip(conclusions) {
            end += *contacts;
            contact_ends.push(end);
            let mut say = |kind| events.push(Event { kind, bodies: candidate.memory.ids.map(BodyId::from_raw) });
            for (happened, kind) in
                [(*begins, EventKind::Begin), (*ends, EventKind::End), (*overloads, EventKind::Overload)]
            {
                if happened {
                    say(kind);
                }
            }
        }
        contacts.resize(state.resting_contacts + end, Contact::default());
        team.each_piece(&mut contacts[state.resting_contacts..], contact_ends, |index, contacts| {
            for (place, contact) in contacts.iter_mut().zip(self.contacts_of(&candidates[index])) {
                *place = contact;
            }
        });
        contacts.extend_from_slice(&state.substance_contacts);
        state.counters.patches = contacts.len() as u32;
    }

    /// The contacts of a candidate as they were last evaluated.
    pub(super) fn contacts_of<'a>(&'a self, candidate: &'a Candidate) -> impl Iterator<Item = Contact> + 'a {
        let pair = &candidate.pair;
        let of = move |[i, j]: [usize; 2], sums: &Sums| {
            let link = |side: &Side, index: usize| self.links.id_of(side.links[index] as usize);
            let skeleton = |side: &Side, index: usize| self.skeletons.id_of(side.ids[index] as usize);
            Contact {
                bodies: candidate.bodies.map(|body| self.bodies.id_of(body as usize)),
                links: [link(&pair.a, i), link(&pair.b, j)],
                skeletons: [skeleton(&pair.a, i), skeleton(&pair.b, j)],
                position: pair.origin + sums.center,
                force: sums.force,
                torque: sums.torque,
                ..Contact::default()
            }
        };
        let pressing = candidate.pressing().map(move |(patch, sums)| Contact {
            normal: sums.force.normalize(),
            area: sums.area,
            peak_pressure: patch.peak_pressure,
            stiffness: sums.stiffness,
            error_estimate: patch.error_estimate,
            evaluations: patch.evaluations,
            scheme: patch.scheme,
            overloaded: patch.overloaded,
            ..of(patch.skeletons, sums)
        });
        let pushed_out = candidate.push_outs().map(move |((i, j, approach), sums)| {
            let pushes = sums.force != Vec3::zeros();
            Contact {
                position: pair.origin + if pushes { sums.center } else { approach.meeting },
                normal: if pushes { sums.force.normalize() } else { approach.direction },
                error_estimate: 1.0,
                overloaded: true,
                ..of([*i, *j], sums)
            }
        });
        pressing.chain(pushed_out)
    }
}
