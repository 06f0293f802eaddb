//! Poses, wrenches, and inertia tensors of common solids.

use super::guard::free;
use super::pointer::Out;
use super::status::{Checked, ISOCOAT_ERROR_OUT_OF_RANGE, Refusal, isocoat_status};
use crate::math::{Pose, Quat, Wrench};

/// Position and orientation of a frame in the world.
#[derive(Clone, Copy, Debug, PartialEq)]
#[repr(C)]
pub struct isocoat_pose {
    /// Origin of the frame, in m. Default 0.
    pub position: [f64; 3],
    /// Rotation from the frame to the world: a quaternion x, y, z, w with a norm of 1 within 1e-3; it is normalised.
    /// Default 0, 0, 0, 1.
    pub orientation: [f64; 4],
}

/// A force and a torque, in the world's axes; or an impulse and an angular impulse.
#[derive(Clone, Copy, Debug, PartialEq)]
#[repr(C)]
pub struct isocoat_wrench {
    /// Force, in N; as an impulse, in N s.
    pub force: [f64; 3],
    /// Torque about the centre of mass, in N m; as an impulse, in N m s.
    pub torque: [f64; 3],
}

impl From<&Pose> for isocoat_pose {
    fn from(pose: &Pose) -> Self {
        Self { position: pose.position.into(), orientation: pose.rotation.coords.into() }
    }
}

impl From<&isocoat_pose> for Pose {
    fn from(pose: &isocoat_pose) -> Self {
        let [x, y, z, w] = pose.orientation;
        // Not normalised here: the Rust API refuses what is not near 1, and normalises the rest.
        Self { position: pose.position.into(), rotation: Quat::new_unchecked(nalgebra::Quaternion::new(w, x, y, z)) }
    }
}

impl From<Wrench> for isocoat_wrench {
    fn from(wrench: Wrench) -> Self {
        Self { force: wrench.force.into(), torque: wrench.torque.into() }
    }
}

fn positive(name: &str, value: f64) -> Checked<()> {
    if value.is_finite() && value > 0.0 {
        return Ok(());
    }
    Err(Refusal::new(ISOCOAT_ERROR_OUT_OF_RANGE, format!("{name} is {value}; must be > 0")))
}

/// A diagonal tensor, row by row.
fn diagonal(x: f64, y: f64, z: f64) -> [f64; 9] {
    [x, 0.0, 0.0, 0.0, y, 0.0, 0.0, 0.0, z]
}

/// Inertia tensor of a solid ball about its centre: 2/5 m r^2 about every axis.
///
/// - mass: in kg, > 0.
/// - radius: in m, > 0.
/// - inertia: receives 9 doubles, row by row, in kg m^2; not NULL.
///
/// Errors: OUT_OF_RANGE, INVALID_ARGUMENT. Threads: any.
///
/// <!--
/// cbindgen:ptrs-as-arrays=[[inertia;9]]
/// -->
#[must_use]
#[unsafe(no_mangle)]
pub unsafe extern "C" fn isocoat_inertia_of_sphere(mass: f64, radius: f64, inertia: *mut f64) -> isocoat_status {
    free(|| {
        // SAFETY: the host gives 9 doubles.
        let out = unsafe { Out::new(inertia.cast::<[f64; 9]>(), "inertia") }?;
        positive("mass", mass)?;
        positive("radius", radius)?;
        let moment = 0.4 * mass * radius * radius;
        out.put(diagonal(moment, moment, moment));
        Ok(())
    })
}

/// Inertia tensor of a solid box about its centre, in its own axes: m/3 (b^2 + c^2) about the axis of half extent a.
///
/// - mass: in kg, > 0.
/// - half_extents: 3 doubles, in m, each > 0; not NULL.
/// - inertia: receives 9 doubles, row by row, in kg m^2; not NULL.
///
/// Errors: OUT_OF_RANGE, INVALID_ARGUMENT. Threads: any.
///
/// <!--
/// cbindgen:ptrs-as-arrays=[[half_extents;3], [inertia;9]]
/// -->
#[must_use]
#[unsafe(no_mangle)]
pub unsafe extern "C" fn isocoat_inertia_of_box(
    mass: f64,
    half_extents: *const f64,
    inertia: *mut f64,
) -> isocoat_status {
    free(|| {
        // SAFETY: the host gives 3 doubles, and room for 9.
        let (half, out) = unsafe {
            (
                super::pointer::read_vector(half_extents, "half_extents")?,
                Out::new(inertia.cast::<[f64; 9]>(), "inertia")?,
            )
        };
        positive("mass", mass)?;
        for (index, half) in half.iter().enumerate() {
            positive(&format!("half_extents[{index}]"), *half)?;
        }
        let squares = half.component_mul(&half);
        let moment = |a: usize, b: usize| mass / 3.0 * (squares[a] + squares[b]);
        out.put(diagonal(moment(1, 2), moment(2, 0), moment(0, 1)));
        Ok(())
    })
}

/// Inertia tensor of a solid capsule along z about its centre: a cylinder between two half balls, of one density.
///
/// - mass: in kg, > 0.
/// - radius: in m, > 0.
/// - half_length: from the centre to the centre of a half ball, in m, at least 0 (0 is a ball).
/// - inertia: receives 9 doubles, row by row, in kg m^2; not NULL.
///
/// Errors: OUT_OF_RANGE, INVALID_ARGUMENT. Threads: any.
///
/// <!--
/// cbindgen:ptrs-as-arrays=[[inertia;9]]
/// -->
#[must_use]
#[unsafe(no_mangle)]
pub unsafe extern "C" fn isocoat_inertia_of_capsule(
    mass: f64,
    radius: f64,
    half_length: f64,
    inertia: *mut f64,
) -> isocoat_status {
    free(|| {
        // SAFETY: the host gives room for 9 doubles.
        let out = unsafe { Out::new(inertia.cast::<[f64; 9]>(), "inertia") }?;
        positive("mass", mass)?;
        positive("radius", radius)?;
        if !half_length.is_finite() || half_length < 0.0 {
            let message = format!("half_length is {half_length}; must be finite and at least 0");
            return Err(Refusal::new(ISOCOAT_ERROR_OUT_OF_RANGE, message));
        }
        // Volumes over pi r^2: 2 h of cylinder, 4/3 r of ball.
        let (r, h) = (radius, half_length);
        let density = mass / (2.0 * h + 4.0 / 3.0 * r);
        let (cylinder, ball) = (density * 2.0 * h, density * 4.0 / 3.0 * r);
        let axial = r * r * (0.5 * cylinder + 0.4 * ball);
        // A half ball's own centre of mass lies 3/8 r beyond the end of the cylinder.
        let across = cylinder * (0.25 * r * r + h * h / 3.0) + ball * (0.4 * r * r + h * h + 0.75 * h * r);
        out.put(diagonal(across, across, axial));
        Ok(())
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::capi::status::ISOCOAT_OK;

    /// Second moments by midpoint sums over the solid.
    fn brute_force(mass: f64, extent: [f64; 3], inside: impl Fn(f64, f64, f64) -> bool) -> [f64; 9] {
        const N: usize = 96;
        let at = |i: usize, half: f64| half * ((2 * i + 1) as f64 / N as f64 - 1.0);
        let (mut moments, mut count) = ([0.0; 3], 0.0);
        for i in 0..N * N * N {
            let [x, y, z] = [(i % N, 0), (i / N % N, 1), (i / (N * N), 2)].map(|(k, axis)| at(k, extent[axis]));
            if inside(x, y, z) {
                count += 1.0;
                moments[0] += y * y + z * z;
                moments[1] += z * z + x * x;
                moments[2] += x * x + y * y;
            }
        }
        let [x, y, z] = moments.map(|moment| moment * mass / count);
        diagonal(x, y, z)
    }

    fn assert_near(actual: [f64; 9], expected: [f64; 9]) {
        for (a, e) in actual.iter().zip(&expected) {
            assert!((a - e).abs() <= 2e-3 * expected[0], "{actual:?} {expected:?}");
        }
    }

    #[test]
    fn inertia_tensors_agree_with_sums_over_the_solid() {
        let mut out = [0.0; 9];
        // SAFETY: the arrays are as long as they must be.
        unsafe {
            assert_eq!(isocoat_inertia_of_sphere(3.0, 0.5, out.as_mut_ptr()), ISOCOAT_OK);
            assert_near(out, brute_force(3.0, [0.5; 3], |x, y, z| x * x + y * y + z * z < 0.25));
            assert_eq!(isocoat_inertia_of_box(2.0, [0.1, 0.2, 0.4].as_ptr(), out.as_mut_ptr()), ISOCOAT_OK);
            assert_near(out, brute_force(2.0, [0.1, 0.2, 0.4], |_, _, _| true));
            assert_eq!(isocoat_inertia_of_capsule(1.5, 0.3, 0.7, out.as_mut_ptr()), ISOCOAT_OK);
            let inside = |x: f64, y: f64, z: f64| {
                let beyond = (z.abs() - 0.7).max(0.0);
                x * x + y * y + beyond * beyond < 0.09
            };
            assert_near(out, brute_force(1.5, [0.3, 0.3, 1.0], inside));
            let mut ball = [0.0; 9];
            assert_eq!(isocoat_inertia_of_capsule(1.5, 0.3, 0.0, out.as_mut_ptr()), ISOCOAT_OK);
            assert_eq!(isocoat_inertia_of_sphere(1.5, 0.3, ball.as_mut_ptr()), ISOCOAT_OK);
            assert_near(out, ball);
        }
    }
}
