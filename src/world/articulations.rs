//! Articulations: what the host says of links that its joints hold together.

use super::{LinkId, World};
use crate::base::{self, Kind};
use crate::error::{Error, Result, out_of_range, require};
use crate::response::envelope::{BLOCK, Envelope};

/// Links of a host that joints hold together, and how they answer pushes.
#[derive(Clone, Copy, Debug)]
pub struct Articulation<'a> {
    /// Host-driven links with a mass, each once: at least those that touch something. At most 256.
    pub links: &'a [LinkId],
    /// From impulses on all of them, each about its centre of mass, to the changes of all their velocities, in the world:
    /// symmetric and positive definite, `6n` rows of `6n` numbers for `n` links, each link's linear part before its
    /// angular one \[1/kg, 1/(kg m), 1/(kg m²)\]. Of a robot with joint inertia `H` and Jacobians `J` it is `J H⁻¹ Jᵀ`, with
    /// a millionth of the bodies' own inverse inertia added where that is singular.
    pub inverse_inertia: &'a [f64],
}

/// Most links of an articulation.
const MOST_LINKS: usize = 256;

/// How far a matrix may be from symmetric, as a part of what both entries' diagonals allow.
const SKEW: f64 = 1e-6;

impl World {
    /// Says which host-driven links move each other through joints, and how, in place of all that was said before; it
    /// holds until it is said anew, or one of an articulation's links is destroyed,
    /// changes its kind or loses its mass. None is changed when one is refused.
    ///
    /// The implicit response solves their contacts together, so that links that joints hold touch anything in any number
    /// without an estimate of what holds them; other responses take each link by itself. The host's joints must pass on
    /// the impulses that it gets as the matrix says. What acts on the links by themselves, joints included, goes into
    /// [`super::LinkDesc::external_acceleration`].
    pub fn set_articulations(&mut self, articulations: &[Articulation]) -> Result<()> {
        self.try_set_articulations(articulations).map_err(|(_, error)| error)
    }

    /// The same; an error comes with the place of the articulation that is refused.
    pub(crate) fn try_set_articulations(
        &mut self,
        articulations: &[Articulation],
    ) -> std::result::Result<(), (usize, Error)> {
        let mut fresh = Vec::with_capacity(articulations.len());
        for (index, Articulation { links, inverse_inertia }) in articulations.iter().enumerate() {
            let slots = links.iter().map(|link| self.links.get(*link).map(|_| link.raw.index)).collect::<Result<_>>();
            let inverse_inertia = inverse_inertia.to_vec();
            fresh.push(base::Articulation { links: slots.map_err(|error| (index, error))?, inverse_inertia });
        }
        self.check_articulations(&fresh)?;
        self.take_articulations(fresh);
        Ok(())
    }

    /// Checks all together; their links are live.
    pub(super) fn check_articulations(
        &self,
        articulations: &[base::Articulation],
    ) -> std::result::Result<(), (usize, Error)> {
        let mut seen = vec![false; self.links.capacity()];
        let mut check = |articulation: &base::Articulation| {
            let count = articulation.links.len();
            check_count(count)?;
            let numbers = articulation.inverse_inertia.len();
            if numbers != (BLOCK * count).pow(2) {
                return Err(out_of_range("inverse_inertia", format_args!("{numbers} numbers"), "(6n)² for n links"));
            }
            for link in &articulation.links {
                let desc = &self.links[*link as usize].desc;
                if desc.kind != Kind::Host || desc.mass == 0.0 {
                    return Err(Error::Unsupported("a link of an articulation must be host-driven, with a mass"));
                }
                if std::mem::replace(&mut seen[*link as usize], true) {
                    return Err(Error::Unsupported("a link may be named once in all articulations"));
                }
            }
            check_inertia(articulation)
        };
        articulations.iter().enumerate().try_for_each(|(index, one)| check(one).map_err(|error| (index, error)))
    }

    /// Puts sound articulations in the place of those that were.
    pub(super) fn take_articulations(&mut self, fresh: Vec<base::Articulation>) {
        let mut now = vec![false; self.links.capacity()];
        for link in fresh.iter().flat_map(|one| &one.links) {
            now[*link as usize] = true;
        }
        for link in self.articulations.iter().chain(&fresh).flat_map(|one| &one.links) {
            let (slot, now) = (&mut self.links[*link as usize], now[*link as usize]);
            // What seemed to hold a link was judged by another inertia.
            if slot.articulated != now {
                slot.articulated = now;
                slot.mirror.forget_hold();
            }
        }
        self.articulations = fresh;
    }

    /// Ends the articulation of a link.
    pub(super) fn end_articulation_of(&mut self, link: u32) {
        if self.links[link as usize].articulated {
            let (ended, rest) =
                std::mem::take(&mut self.articulations).into_iter().partition(|one| one.links.contains(&link));
            self.articulations = ended;
            self.take_articulations(rest);
        }
    }
}

/// Refuses a number of links.
pub(crate) fn check_count(count: usize) -> Result<()> {
    require("number of links", count as f64, "from 1 to 256", |_| (1..=MOST_LINKS).contains(&count))
}

fn check_inertia(articulation: &base::Articulation) -> Result<()> {
    let refuse = |why: String| Err(out_of_range("inverse_inertia", why, "finite, symmetric and positive definite"));
    let width = BLOCK * articulation.links.len();
    let at = |row: usize, column: usize| articulation.inverse_inertia[row * width + column];
    for row in 0..width {
        for column in 0..row {
            let skew = (at(row, column) - at(column, row)).abs();
            if skew.is_nan() || skew > SKEW * (at(row, row) * at(column, column)).sqrt() {
                let (one, other) = (at(row, column), at(column, row));
                return refuse(format!("{one} at row {row}, column {column}, and {other} across the diagonal"));
            }
        }
    }
    let mut matrix = Envelope::default();
    matrix.fill(articulation.links.len(), |to, from| articulation.block(to, from));
    if matrix.factor() { Ok(()) } else { refuse("not positive definite".into()) }
}
