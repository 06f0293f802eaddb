//! Territories: the part of the solid where one skeleton's field is the highest \[97, eq. (21)\], and the seeds that
//! sample its share of the surface.
//!
//! A seed goes out from its skeleton along its ray, until it meets the coat's surface or the territory of another
//! skeleton \[97, section 5.1\]. Where two fields are equal, the territory belongs to the skeleton that comes first, as
//! in [`blend::territory`], within a tolerance that keeps rounding out of it.
//!
//! Seeds move only when the links of a body move relative to each other, so a root need not be fast: it is found from
//! a bracket that depends on the coat alone, never on where the seed was before. The same coat gives the same bits,
//! whatever happened earlier.

use super::Coat;
use super::root::bracketed;
use super::seeds::Ray;
use crate::field::{Placed, blend};
use crate::math::Vec3;

/// What a seed ran into.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum End {
    /// The surface of the coat: the seed is valid.
    Surface,
    /// The territory of the skeleton with this index: the seed samples no surface.
    Territory(usize),
}

/// Where a seed ended.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Seed {
    /// Where it is, in the frame of the coat \[m\].
    pub position: Vec3,
    /// Outward unit normal of the field there.
    pub normal: Vec3,
    /// How far it went from the skeleton \[m\].
    pub distance: f64,
    /// What it ran into.
    pub end: End,
}

impl Seed {
    /// Whether the seed lies on the coat's surface.
    pub fn is_valid(&self) -> bool {
        self.end == End::Surface
    }
}

/// The skeletons whose field can reach that of skeleton `index`, by their bounds; in order, without itself.
pub fn neighbours(skeletons: &[Placed], index: usize, out: &mut Vec<usize>) {
    let bounds = |skeleton: &Placed| skeleton.shape.bounds(skeleton.profile.radius);
    let (low, high) = bounds(&skeletons[index]);
    out.clear();
    out.extend((0..skeletons.len()).filter(|other| {
        let (l, h) = bounds(&skeletons[*other]);
        *other != index && (0..3).all(|k| l[k] <= high[k] && low[k] <= h[k])
    }));
}

/// Fields that differ by less than this fraction of the isovalue count as equal: skeletons that share a corner tie in a
/// whole region, where rounding must not decide.
const TIE: f64 = 1e-10;

/// How far the field `own` of skeleton `index` is ahead of another's, and so much more or less that ties go to the
/// skeleton that comes first.
fn ahead_of(own: f64, value: f64, index: usize, other: usize, isovalue: f64) -> f64 {
    let tie = TIE * isovalue;
    own - value + if index < other { tie } else { -tie }
}

/// Whether a point lies in the territory of skeleton `index` \[97, eq. (21)\], ties settled as everywhere here.
pub fn owns(skeletons: &[Placed], isovalue: f64, index: usize, p: &Vec3) -> bool {
    let own = skeletons[index].value(p);
    let mut others = skeletons.iter().enumerate().filter(|(other, _)| *other != index);
    others.all(|(other, skeleton)| ahead_of(own, skeleton.value(p), index, other, isovalue) >= 0.0)
}

/// Follows a ray of skeleton `index` from its foot, in the frame of the coat. Gives the distance \[m\] and what the ray
/// ran into.
///
/// `neighbours` are the skeletons that may matter, from [`neighbours`]; without any, the ray ends at the thickness. The
/// walk looks ahead by an eighth of the thickness, or by half the thickness of the thinnest neighbour if that is less,
/// but at least by a 32nd of the thickness: it may step over what is shorter.
pub fn follow(coat: &Coat, index: usize, neighbours: &[usize], ray: &Ray) -> (f64, End) {
    let own = &coat.skeletons[index];
    let (thickness, radius) = (own.profile.thickness, own.profile.radius);
    if neighbours.is_empty() {
        return (thickness, End::Surface);
    }
    let look = |r: f64| View::at(coat, index, neighbours, &ray.at(r));
    let thinnest = neighbours.iter().map(|j| coat.skeletons[*j].profile.thickness).fold(f64::INFINITY, f64::min);
    let stride = (0.5 * thinnest).clamp(thickness / 32.0, thickness / 8.0);
    let (mut r, mut view) = (0.0, look(0.0));
    if view.lead < 0.0 {
        return (0.0, End::Territory(view.rival));
    }
    while r < radius {
        // No other field is negative, so the surface lies at the thickness or beyond: a node of the walk.
        let next = (r + stride).min(if r < thickness { thickness } else { radius });
        let ahead = look(next);
        let border = (ahead.lead < 0.0).then(|| bracketed(r, next, view.lead, ahead.lead, |x| look(x).lead));
        // A ray may leave the solid just before it enters another territory: the surface then comes first.
        let (end, at_end) = border.map_or((next, ahead.excess), |border| (border, look(border).excess));
        if at_end < 0.0 && end > thickness {
            let surface = bracketed(r, end, view.excess, at_end, |x| look(x).excess);
            let there = look(surface);
            // Another territory may have been entered, and left again beyond the surface, within the stride.
            if there.lead < 0.0 {
                let border = bracketed(r, surface, view.lead, there.lead, |x| look(x).lead);
                return (border, End::Territory(there.rival));
            }
            return (surface, End::Surface);
        }
        if let Some(border) = border {
            return (border, End::Territory(ahead.rival));
        }
        (r, view) = (next, ahead);
    }
    // The own field ends here: whatever is still above the isovalue is another territory.
    (radius, End::Territory(view.rival))
}

/// What a ray sees at one point.
struct View {
    /// Field of all skeletons less the isovalue.
    excess: f64,
    /// How far the own field is ahead of the highest of the others, see [`ahead_of`].
    lead: f64,
    /// The skeleton whose field is the highest of the others.
    rival: usize,
}

impl View {
    fn at(coat: &Coat, index: usize, neighbours: &[usize], p: &Vec3) -> Self {
        let own = coat.skeletons[index].value(p);
        let (mut lead, mut rival) = (f64::INFINITY, index);
        let others = neighbours.iter().map(|other| (*other, coat.skeletons[*other].value(p)));
        let compared = others.inspect(|(other, value)| {
            let ahead = ahead_of(own, *value, index, *other, coat.isovalue);
            if ahead < lead {
                (lead, rival) = (ahead, *other);
            }
        });
        let sum = blend::together(&coat.graph, std::iter::once((index, own)).chain(compared));
        Self { excess: sum - coat.isovalue, lead, rival }
    }
}

/// Appends the seeds of skeleton `index`: one for each of its rays, which are in the frame of the coat.
pub fn seeds(coat: &Coat, index: usize, rays: &[Ray], out: &mut Vec<Seed>) {
    let mut around = Vec::new();
    neighbours(&coat.skeletons, index, &mut around);
    for ray in rays {
        let (distance, end) = follow(coat, index, &around, ray);
        let position = ray.at(distance);
        out.push(Seed { position, normal: coat.normal(&position, &ray.direction), distance, end });
    }
}
