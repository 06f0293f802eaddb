//! Springs in a sub-step, and how many sub-steps they ask for.

use crate::base::Motion;
use crate::base::springs::{Line, Spring};
use crate::math::{Vec3, Wrench};

/// Gives the links the impulses of their springs over `h` seconds, one spring after the other: elastic forces depend on
/// the poses only, and each damper sees what those before it have left, which keeps any number of them stable.
pub fn kick(springs: &[Spring], motions: &mut [Motion], h: f64) {
    for spring in springs {
        let line = spring.line(motions);
        let Some(direction) = line.direction() else { continue };
        let [a, b] = spring.links.map(|link| &motions[link as usize]);
        let mobility = a.mobility(&line.arms[0], &direction) + b.mobility(&line.arms[1], &direction);
        let (stretch, rate) = (line.length() - spring.law.rest_length, direction.dot(&line.velocity));
        push(spring, &line, &(direction * spring.law.impulse(stretch, rate, mobility, h)), motions);
    }
}

/// Gives the second link an impulse at its end of the spring, and the first its opposite.
fn push(spring: &Spring, line: &Line, impulse: &Vec3, motions: &mut [Motion]) {
    for ((link, arm), impulse) in spring.links.into_iter().zip(&line.arms).zip([-impulse, *impulse]) {
        motions[link as usize].push(&Wrench { force: impulse, torque: arm.cross(&impulse) });
    }
}

/// Adds to each link's square of the rate what its springs bring.
pub fn add_rates(springs: &[Spring], motions: &[Motion], rates: &mut [f64]) {
    for spring in springs {
        let rate2 = spring.rate2(motions);
        for link in spring.links.into_iter().filter(|link| motions[*link as usize].is_movable()) {
            rates[link as usize] += rate2;
        }
    }
}
