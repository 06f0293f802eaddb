//! Contact forces by brute force: the volume integral of `∇p_b` over the part of the overlap where b is the less
//! compressed, `F = ∫ ∇p_b dV over {0 < p_b < p_a}`, line by line along each axis. It knows nothing of surfaces,
//! frames or patches, and has distances and profiles of its own.

use isocoat::field::Shape;
use isocoat::math::{Pose, Vec3};

use super::Coat;

fn to_segment(a: Vec3, b: Vec3, p: Vec3) -> f64 {
    let ab = b - a;
    let s = ((p - a).dot(&ab) / ab.dot(&ab)).clamp(0.0, 1.0);
    (p - a - ab * s).norm()
}

/// Distance to a shape whose points are given in the world.
fn distance(shape: &Shape, p: Vec3) -> f64 {
    match *shape {
        Shape::Point(a) => (p - a).norm(),
        Shape::Segment(a, b) => to_segment(a, b, p),
        Shape::Triangle(a, b, c) => {
            let n = (b - a).cross(&(c - a));
            let inside = [(a, b), (b, c), (c, a)].iter().all(|(u, v)| (v - u).cross(&(p - u)).dot(&n) >= 0.0);
            if inside {
                (p - a).dot(&n).abs() / n.norm()
            } else {
                to_segment(a, b, p).min(to_segment(b, c, p)).min(to_segment(c, a, p))
            }
        }
        Shape::Box { center, half, axes } => {
            let q = (axes.transpose() * (p - center)).abs() - half;
            q.sup(&Vec3::zeros()).norm() + q.max().min(0.0)
        }
        Shape::Plane { point, normal } => (p - point).dot(&normal),
    }
}

/// The default profile, `k = 2c/(R-t)` with c = 1: a parabola outside, linear inside.
fn profile(d: f64, t: f64, r: f64) -> f64 {
    if d >= r {
        0.0
    } else if d >= t {
        ((r - d) / (r - t)).powi(2)
    } else {
        1.0 + 2.0 / (r - t) * (t - d)
    }
}

/// Maximum of a function with one hump between two places, by golden section; stops early at a positive value.
fn climb(f: &dyn Fn(f64) -> f64, mut low: f64, mut high: f64) -> f64 {
    const GOLDEN: f64 = 0.618_033_988_749_894_9;
    for _ in 0..24 {
        let (x, y) = (high - GOLDEN * (high - low), low + GOLDEN * (high - low));
        let (fx, fy) = (f(x), f(y));
        if fx > 0.0 || fy > 0.0 {
            return if fx > fy { x } else { y };
        }
        if fx > fy { high = y } else { low = x }
    }
    0.5 * (low + high)
}

pub struct Oracle {
    a: (Coat, Vec<Shape>),
    b: (Coat, Vec<Shape>),
}

impl Oracle {
    pub fn new(a: (&Coat, Pose), b: (&Coat, Pose)) -> Self {
        let place = |(coat, pose): (&Coat, Pose)| {
            (coat.clone(), coat.shapes.iter().map(|shape| shape.transformed(&pose)).collect())
        };
        Oracle { a: place(a), b: place(b) }
    }

    fn excess((coat, shapes): &(Coat, Vec<Shape>), p: Vec3) -> f64 {
        shapes.iter().map(|shape| profile(distance(shape, p), coat.thickness, coat.radius)).sum::<f64>() - 1.0
    }

    /// Positive in `{0 < p_b < p_a}`; for a rigid b, in `{0 < p_a} within b`, negated roles for a rigid a.
    fn side(&self, p: Vec3) -> (f64, f64) {
        let (ea, eb) = (Self::excess(&self.a, p), Self::excess(&self.b, p));
        let (pa, pb) = (ea * self.a.0.stiffness_scale, eb * self.b.0.stiffness_scale);
        match (self.a.0.rigid, self.b.0.rigid) {
            (false, false) => (pb.min(pa - pb), pb),
            // Rigid b: F = -∫ ∇p_a over the overlap.
            (false, true) => (pa.min(eb * self.a.0.stiffness_scale), -pa),
            (true, false) => (pb.min(ea * self.b.0.stiffness_scale), pb),
            _ => unreachable!("two rigid bodies have no contact surface"),
        }
    }

    /// A box that holds the overlap: on the surface of a blend one of its n fields at least has its share, `c/n`.
    fn overlap(&self) -> (Vec3, Vec3) {
        let bounds = |(coat, shapes): &(Coat, Vec<Shape>)| {
            let share = 1.0 / shapes.len() as f64;
            let reach = coat.radius - (coat.radius - coat.thickness) * share.sqrt();
            let each = shapes.iter().map(|shape| match shape {
                // A level floor.
                Shape::Plane { point, .. } => (Vec3::repeat(-1e9), Vec3::new(1e9, 1e9, point.z + reach)),
                other => other.bounds(reach),
            });
            each.reduce(|(l, h), (low, high)| (l.inf(&low), h.sup(&high))).unwrap()
        };
        let ((la, ha), (lb, hb)) = (bounds(&self.a), bounds(&self.b));
        let mut bounds = (la.sup(&lb), ha.inf(&hb));
        for _ in 0..3 {
            bounds = self.shrunk(bounds);
        }
        bounds
    }

    /// A box without the layers of cells in which the two cannot overlap.
    fn shrunk(&self, (low, high): (Vec3, Vec3)) -> (Vec3, Vec3) {
        const CELLS: usize = 20;
        let cell = (high - low) / CELLS as f64;
        // Nowhere in a cell is a shape nearer than from the middle by half its diagonal.
        let most = |(coat, shapes): &(Coat, Vec<Shape>), middle: Vec3| {
            let nearest = |shape: &Shape| distance(shape, middle) - 0.5 * cell.norm();
            shapes.iter().map(|shape| profile(nearest(shape), coat.thickness, coat.radius)).sum::<f64>() - 1.0
        };
        let (mut first, mut last) = (Vec3::repeat(CELLS as f64), Vec3::zeros());
        for index in 0..CELLS.pow(3) {
            let corner = Vec3::from([index % CELLS, index / CELLS % CELLS, index / CELLS.pow(2)].map(|i| i as f64));
            let middle = low + corner.add_scalar(0.5).component_mul(&cell);
            if most(&self.a, middle) > 0.0 && most(&self.b, middle) > 0.0 {
                first = first.inf(&corner);
                last = last.sup(&corner.add_scalar(1.0));
            }
        }
        // Nothing overlaps: the box is as good as any.
        if first.x > last.x {
            return (low, high);
        }
        (low + first.component_mul(&cell), low + last.component_mul(&cell))
    }

    /// Force on b, with `n` by `n` lines along each axis.
    pub fn force(&self, n: usize) -> Vec3 {
        self.force_by(n, 72)
    }

    /// The same with so many samples on a line: between two of them a thin overlap may be missed.
    pub fn force_by(&self, n: usize, steps: usize) -> Vec3 {
        let (low, high) = self.overlap();
        let mut force = Vec3::zeros();
        for axis in 0..3 {
            let (u, v) = ((axis + 1) % 3, (axis + 2) % 3);
            let cell = Vec3::from_fn(|i, _| (high[i] - low[i]) / n as f64);
            for i in 0..n {
                for j in 0..n {
                    let at = |s: f64| {
                        let mut p = Vec3::zeros();
                        p[u] = low[u] + (i as f64 + 0.5) * cell[u];
                        p[v] = low[v] + (j as f64 + 0.5) * cell[v];
                        p[axis] = low[axis] + s * (high[axis] - low[axis]);
                        p
                    };
                    let positive = |s: f64| self.side(at(s)).0;
                    let samples: Vec<f64> = (0..=steps).map(|step| positive(step as f64 / steps as f64)).collect();
                    // Places where the sign is known, those between the samples included.
                    let mut signs: Vec<(f64, bool)> = Vec::with_capacity(steps + 4);
                    for step in 0..=steps {
                        let s = step as f64 / steps as f64;
                        let hidden = step > 0 && step < steps && samples[step] <= 0.0;
                        if hidden && samples[step] >= samples[step - 1] && samples[step] >= samples[step + 1] {
                            let top = climb(&positive, s - 1.0 / steps as f64, s + 1.0 / steps as f64);
                            if positive(top) > 0.0 {
                                if top < s {
                                    signs.extend([(top, true), (s, false)]);
                                } else {
                                    signs.extend([(s, false), (top, true)]);
                                }
                                continue;
                            }
                        }
                        signs.push((s, samples[step] > 0.0));
                    }
                    for ends in signs.windows(2) {
                        let [(mut x, inside), (mut y, next)] = [ends[0], ends[1]];
                        if inside == next {
                            continue;
                        }
                        for _ in 0..40 {
                            let m = 0.5 * (x + y);
                            if (positive(m) > 0.0) == inside { x = m } else { y = m }
                        }
                        // Upper ends of intervals count plus, lower ends minus.
                        let sign = if inside { 1.0 } else { -1.0 };
                        force[axis] += sign * self.side(at(0.5 * (x + y))).1 * cell[u] * cell[v];
                    }
                }
            }
        }
        force
    }
}

/// Volume of the territory of each of some bounded skeletons (shape, thickness, radius) that blend, by counting the
/// cells of a lattice with `n` along the longest side.
pub fn territories(skeletons: &[(Shape, f64, f64)], n: usize) -> Vec<f64> {
    let bounds = skeletons.iter().map(|(shape, _, radius)| shape.bounds(*radius));
    let (low, high) = bounds.reduce(|(l, h), (low, high)| (l.inf(&low), h.sup(&high))).unwrap();
    let cell = (high - low).max() / n as f64;
    let counts = ((high - low) / cell).map(|x| x.ceil() as usize);
    let mut volumes = vec![0.0; skeletons.len()];
    for index in 0..counts.product() {
        let place = Vec3::new(
            (index % counts.x) as f64,
            (index / counts.x % counts.y) as f64,
            (index / (counts.x * counts.y)) as f64,
        );
        let p = low + (place + Vec3::repeat(0.5)) * cell;
        let (mut sum, mut best) = (0.0, (0, f64::NEG_INFINITY));
        for (index, (shape, thickness, radius)) in skeletons.iter().enumerate() {
            let value = profile(distance(shape, p), *thickness, *radius);
            sum += value;
            if value > best.1 {
                best = (index, value);
            }
        }
        if sum >= 1.0 {
            volumes[best.0] += cell.powi(3);
        }
    }
    volumes
}
