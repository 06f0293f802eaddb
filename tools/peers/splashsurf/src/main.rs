//! The surface of particles at spacing r0, cells of r0/4, on one thread: splashsurf (single precision, SIMD, density and
//! decomposition included) beside isocoat (double precision, sorting included), run in turns.

use std::time::Instant;

use isocoat::coat::Coat;
use isocoat::field::{Placed, Profile, Shape};
use isocoat::math::Vec3;
use isocoat::surface::deformed::Deformed;
use isocoat::surface::mesh::coated::{Coated, Scratch};
use isocoat::surface::mesh::{Mesh, Workspace, mesh};
use splashsurf_lib::nalgebra::Vector3;
use splashsurf_lib::{Parameters, SurfaceReconstruction, reconstruct_surface_inplace};

const SPACING: f64 = 0.01;
const RUNS: usize = 9;

/// A ball of this many particles: a cubic lattice, each shaken by up to a fifth of the spacing.
fn particles(count: usize) -> Vec<Vec3> {
    let mut state = 0.5_f64;
    let mut number = || {
        state = (state + 0.618_033_988_749_894_9).fract();
        2.0 * state - 1.0
    };
    let side = (count as f64 * 2.0).cbrt().ceil() as i32 / 2 + 1;
    let mut places = Vec::new();
    for z in -side..=side {
        for y in -side..=side {
            for x in -side..=side {
                places.push(Vec3::new(f64::from(x), f64::from(y), f64::from(z)));
            }
        }
    }
    places.sort_by(|a, b| a.norm_squared().total_cmp(&b.norm_squared()));
    places.truncate(count);
    places.iter().map(|p| (p + Vec3::new(number(), number(), number()) * 0.2) * SPACING).collect()
}

/// The same as a coat: its surface is at the spacing and its fields reach two.
fn coat(particles: &[Vec3]) -> Deformed {
    let profile = Profile::new(1.0, SPACING, 0.0, 1.0, 2.0 * SPACING, false).expect("a profile");
    let skeletons = particles.iter().map(|p| Placed { shape: Shape::Point(*p), profile }).collect();
    Deformed { coat: Coat { skeletons, ..Coat::new(Vec3::zeros(), 1.0) }, obstacles: Vec::new() }
}

/// Milliseconds of one call.
fn time(call: impl FnOnce()) -> f64 {
    let start = Instant::now();
    call();
    start.elapsed().as_secs_f64() * 1e3
}

fn main() {
    println!("particles,splashsurf_ms,splashsurf_triangles,isocoat_ms,isocoat_triangles");
    for count in [10_000, 80_000] {
        let particles = particles(count);
        let single: Vec<Vector3<f32>> =
            particles.iter().map(|p| Vector3::new(p.x as f32, p.y as f32, p.z as f32)).collect();
        let spacing = SPACING as f32;
        let mut parameters = Parameters::new(0.5 * spacing, 2.0 * spacing, 0.25 * spacing);
        parameters.enable_multi_threading = false;
        parameters.enable_simd = true;
        let mut surface = SurfaceReconstruction::<i64, f32>::default();
        let coat = coat(&particles);
        let (mut scratch, mut workspace, mut out) = (Scratch::default(), Workspace::default(), Mesh::default());
        let (mut theirs, mut ours) = (f64::INFINITY, f64::INFINITY);
        for _ in 0..RUNS {
            theirs = theirs.min(time(|| {
                reconstruct_surface_inplace(&single, &parameters, &mut surface).expect("a surface");
            }));
            ours = ours.min(time(|| {
                let mut solid = Coated::new(&coat, &mut scratch);
                mesh(&mut solid, 0.25 * SPACING, &mut workspace, &mut out).expect("a mesh");
            }));
        }
        let triangles = surface.mesh.triangles.len();
        println!("{count},{theirs:.2},{triangles},{ours:.2},{}", out.triangles.len());
    }
}
