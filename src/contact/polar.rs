//! The polar patch: a Gauss rule in polar coordinates round the deepest point.
//!
//! The patch is the star-shaped piece of contact surface round its deepest point. In coordinates scaled by the
//! pressure's principal curvatures its border is nearly a circle; azimuths are equally spaced, which converges fast for
//! a smooth border, and along each the radii are the Gauss rule for the weight `s` that knows the pressure to be zero
//! at the border. The frame comes from the contact alone, so turning a body in place changes nothing.
//!
//! Flat faces have corners, and a pressure that drops near the border: no fixed rule sees them. A patch that was not
//! found to be smooth, or whose rules do not agree, is integrated by halving: along each azimuth, and over the azimuths.

use super::column::{Fit, Frame, Solver};
use super::patch::Node;
use super::target::{Integrated, Target, Unfit};
use crate::math::Vec3;

/// A rule for `∫₀¹ f(s) s ds` with `f(1) = 0`, exact to degree `2 n`; and a coarser one on the same points and the
/// centre, whose difference estimates the error.
pub(super) struct Rule {
    pub s: &'static [f64],
    pub weight: &'static [f64],
    pub coarse: &'static [f64],
    pub center: f64,
}

/// Interior Gauss-Lobatto points; weights solved for from the moments of `s`.
pub(super) const RULES: [Rule; 6] = [
    Rule {
        s: &[0.276_393_202_250_021, 0.723_606_797_749_978_9],
        weight: &[0.115_163_834_270_842_1, 0.301_502_832_395_824_6],
        coarse: &[0.0, 0.416_666_666_666_666_7],
        center: 0.051_502_832_395_824_57,
    },
    Rule {
        s: &[0.172_673_164_646_011_43, 0.5, 0.827_326_835_353_988_5],
        weight: &[0.047_005_472_598_080_89, 0.177_777_777_777_777_78, 0.225_216_749_624_141_34],
        coarse: &[0.202_561_028_153_636_44, 0.0, 0.380_772_305_179_696_9],
        center: -0.066_666_666_666_666_67,
    },
    Rule {
        s: &[0.117_472_338_035_267_65, 0.357_384_241_759_677_4, 0.642_615_758_240_322_6, 0.882_527_661_964_732_3],
        weight: &[
            0.022_230_169_002_051_915,
            0.099_148_820_180_416_26,
            0.178_280_368_337_326_9,
            0.167_007_309_146_871_56,
        ],
        coarse: &[0.104_117_186_004_457_9, 0.0, 0.277_429_188_517_743_2, 0.085_120_292_144_465_58],
        center: -0.034_367_729_981_066_38,
    },
    Rule {
        s: &[0.084_888_051_860_716_53, 0.265_575_603_264_642_9, 0.5, 0.734_424_396_735_357_1, 0.915_111_948_139_283_4],
        weight: &[
            0.011_749_611_932_412_892,
            0.057_330_520_035_766_24,
            0.121_904_761_904_761_9,
            0.158_542_170_569_165_06,
            0.126_663_411_748_370_1,
        ],
        coarse: &[
            -0.080_101_372_537_880_13,
            0.172_038_647_363_202_12,
            0.0,
            0.273_250_297_896_600_94,
            0.034_812_427_278_077_06,
        ],
        center: 0.038_095_238_095_238_09,
    },
    Rule {
        s: &[
            0.064_129_925_745_196_69,
            0.204_149_909_283_428_85,
            0.395_350_391_048_760_6,
            0.604_649_608_951_239_4,
            0.795_850_090_716_571_2,
            0.935_870_074_254_803_3,
        ],
        weight: &[
            0.006_756_223_220_456_05,
            0.034_820_083_362_513_21,
            0.081_532_872_879_909_51,
            0.124_696_524_449_442_43,
            0.135_741_262_879_239,
            0.098_595_890_351_296_97,
        ],
        coarse: &[
            -0.051_518_347_830_029_905,
            0.108_967_797_451_318_4,
            0.0,
            0.206_229_397_329_351_94,
            0.061_593_548_790_433_78,
            0.156_870_461_401_782_93,
        ],
        center: 0.023_991_833_869_792_74,
    },
    Rule {
        s: &[
            0.040_233_045_916_770_59,
            0.130_613_067_447_247_46,
            0.261_037_525_094_777_73,
            0.417_360_521_166_806_5,
            0.582_639_478_833_193_6,
            0.738_962_474_905_222_3,
            0.869_386_932_552_752_6,
            0.959_766_954_083_229_4,
        ],
        weight: &[
            0.002_681_653_025_445_852,
            0.014_686_743_401_529_121,
            0.038_117_049_684_890_845,
            0.068_351_082_715_281_38,
            0.095_418_797_876_667_34,
            0.107_904_292_154_951_02,
            0.097_757_927_630_034_1,
            0.063_971_342_400_089_2,
        ],
        coarse: &[
            0.046_286_846_525_767_6,
            -0.041_949_941_020_773_12,
            0.102_658_177_434_806_8,
            0.0,
            0.163_769_880_591_948_72,
            0.043_363_164_405_035_07,
            0.154_394_614_052_336_34,
            0.020_366_148_899_767_45,
        ],
        center: -0.017_803_571_272_317_915,
    },
];

/// Azimuths and radial rule, from the cheapest up.
const LEVELS: [(usize, usize); 9] = [(6, 0), (8, 0), (12, 1), (16, 2), (24, 3), (32, 3), (48, 4), (64, 5), (128, 5)];

/// Part of the tolerance that the roots may use up.
pub(super) const SOLVING: f64 = 0.2;

/// Most azimuths, and most places along one, of a patch that is integrated by halving.
const MOST_AZIMUTHS: usize = 400;
const MOST_RADII: usize = 80;

/// The memory of an integration.
#[derive(Debug, Default)]
pub struct Workspace {
    lines: Vec<Line>,
    nodes: Vec<Node>,
    over_azimuths: Halving,
    along_radius: Halving,
}

/// An azimuth, integrated along its radius.
#[derive(Debug)]
struct Line {
    angle: f64,
    nodes: (usize, usize),
    border: f64,
    /// Of the border.
    height: f64,
    error: f64,
}

/// Integrates the patch round a deepest point to the relative tolerance asked for, appending to `nodes`, and to `border` the
/// radius of the border at equally spaced azimuths, in the frame's units. What does not meet the tolerance stands, with
/// its estimate, when no other scheme is to be used: when polar is `alone`.
pub fn integrate(
    target: &Target,
    alone: bool,
    workspace: &mut Workspace,
    nodes: &mut Vec<Node>,
    border: &mut Vec<f64>,
) -> Result<Integrated, Unfit> {
    let Target { at, extent, tolerance, .. } = *target;
    let (first, first_border) = (nodes.len(), border.len());
    let mut solver = target.solver(Frame::new(at, [1.0, 1.0]));
    let fit = solver.fit(at, extent);
    if fit == Some(Fit::Predicted) {
        let start = match tolerance {
            t if t >= 2e-2 => 0,
            t if t >= 2e-3 => 1,
            t if t >= 2e-4 => 2,
            _ => 3,
        };
        for (azimuths, rule) in LEVELS.iter().skip(start) {
            nodes.truncate(first);
            border.truncate(first_border);
            let Some(error) = sweep(&mut solver, at.sum, *azimuths, &RULES[*rule], border, nodes) else { break };
            // The difference is that of a coarser rule: a smooth patch is at least four times better. The roots are
            // solved to a part of the tolerance.
            let error = 0.25 * error + SOLVING * tolerance;
            if !is_round(&border[first_border..]) {
                break;
            }
            if error <= tolerance {
                return Ok(Integrated { error, evaluations: solver.evaluations, frame: solver.frame });
            }
            // Algebraic convergence does not pay here.
            if error > 30.0 * tolerance {
                break;
            }
        }
        nodes.truncate(first);
        border.truncate(first_border);
    }
    let done = if fit.is_some() { halve(&mut solver, at.sum, tolerance, workspace, border, nodes) } else { None };
    let Some(error) = done.filter(|error| alone || *error <= tolerance) else {
        nodes.truncate(first);
        border.truncate(first_border);
        return Err(Unfit { evaluations: solver.evaluations });
    };
    Ok(Integrated { error, evaluations: solver.evaluations, frame: solver.frame })
}

/// Whether a border is near enough to a circle that a few azimuths tell all of it.
fn is_round(border: &[f64]) -> bool {
    let ends = border.iter().fold((f64::INFINITY, 0.0f64), |(low, high), s| (low.min(*s), high.max(*s)));
    ends.0 > 0.6 * ends.1
}

/// Integrates by halving, along each azimuth and over the azimuths. Gives the estimated relative error, or `None` when
/// the patch is not star-shaped.
fn halve(
    solver: &mut Solver,
    peak: f64,
    tolerance: f64,
    workspace: &mut Workspace,
    borders: &mut Vec<f64>,
    nodes: &mut Vec<Node>,
) -> Option<f64> {
    let Workspace { lines, nodes: pool, over_azimuths, along_radius } = workspace;
    // Room for twice as many as the last time: what rests asks for no memory, though its counts change a little.
    lines.reserve(lines.len());
    pool.reserve(pool.len());
    lines.clear();
    pool.clear();
    let part = 0.5 * (1.0 - SOLVING) * tolerance;
    let over = over_azimuths.integrate(2.0 * std::f64::consts::PI, 8, part, MOST_AZIMUTHS, |angle| {
        let direction = (libm::cos(angle), libm::sin(angle));
        let (border, height) = solver.border(direction, peak, 0.0)?;
        let first = pool.len();
        let mut bay = false;
        let along = along_radius.integrate(border, 2, part, MOST_RADII, |r| {
            let (x, y) = (r * direction.0, r * direction.1);
            let column = solver.column(x, y, height * (r / border).powi(2))?;
            // Out of the contact before its border.
            bay |= column.sum < -1e-3 * peak && r < border;
            // Of the middle's no area a piece of no area.
            let node = if r > 0.0 { solver.node(x, y, &column, r) } else { None };
            pool.push(node.unwrap_or_default());
            Some(pool[pool.len() - 1].force)
        })?;
        if bay {
            return None;
        }
        for (node, point) in pool[first..].iter_mut().zip(&along_radius.points) {
            *node = node.scaled(point.weight);
        }
        lines.push(Line { angle, nodes: (first, pool.len()), border, height, error: along.error });
        Some(along.sum)
    })?;
    // The first to be looked at are equally spaced.
    borders.extend(lines.iter().take(32).map(|line| line.border));
    let mut error = over.error;
    for (line, point) in lines.iter().zip(&over_azimuths.points) {
        error += line.error * point.weight;
        let inside = pool[line.nodes.0..line.nodes.1].iter().filter(|node| node.area > 0.0);
        nodes.extend(inside.map(|node| node.scaled(point.weight)));
    }
    if !is_star_shaped(solver, lines) {
        return None;
    }
    Some(error / over.sum.norm().max(f64::MIN_POSITIVE) + SOLVING * tolerance)
}

/// Whether there is nothing behind the border: where it jumps from one azimuth to the next, there may be a bay, and
/// contact again beyond it. Puts the azimuths in order.
fn is_star_shaped(solver: &mut Solver, lines: &mut [Line]) -> bool {
    lines.sort_by(|a, b| a.angle.total_cmp(&b.angle));
    lines.windows(2).all(|pair| {
        let (short, long) = if pair[0].border < pair[1].border { (&pair[0], &pair[1]) } else { (&pair[1], &pair[0]) };
        if long.border < 1.05 * short.border {
            return true;
        }
        let (x, y) = (libm::cos(short.angle), libm::sin(short.angle));
        [0.3, 0.6, 0.9].into_iter().all(|part| {
            let r = short.border + part * (long.border - short.border);
            solver.column(r * x, r * y, long.height).is_none_or(|column| column.sum <= 0.0)
        })
    })
}

/// Simpson's rule in one dimension, on intervals that are halved where that changes most. Their points are used again.
#[derive(Debug, Default)]
struct Halving {
    points: Vec<Point>,
    pieces: Vec<Piece>,
}

#[derive(Debug)]
struct Point {
    value: Vec3,
    weight: f64,
}

#[derive(Debug)]
struct Piece {
    begin: f64,
    length: f64,
    /// Five points, equally spaced.
    points: [usize; 5],
    sum: Vec3,
    error: f64,
}

/// An integral, and how far it may be off.
struct Integral {
    sum: Vec3,
    error: f64,
}

/// Weights of Simpson's rule twice, on five points of an interval of length one.
const TWICE: [f64; 5] = [1.0 / 12.0, 4.0 / 12.0, 2.0 / 12.0, 4.0 / 12.0, 1.0 / 12.0];
/// And once, on every other point.
const ONCE: [f64; 5] = [2.0 / 12.0, 0.0, 8.0 / 12.0, 0.0, 2.0 / 12.0];

impl Halving {
    /// Integrates a function from 0 to `length`, on `count` pieces first, to a relative tolerance or as far as `most`
    /// points go. Calls it for the points in their order in `points`, which get their weights. `None` when it gives none.
    fn integrate(
        &mut self,
        length: f64,
        count: usize,
        tolerance: f64,
        most: usize,
        mut f: impl FnMut(f64) -> Option<Vec3>,
    ) -> Option<Integral> {
        self.points.reserve(self.points.len());
        self.pieces.reserve(self.pieces.len());
        self.points.clear();
        self.pieces.clear();
        let step = length / (4 * count) as f64;
        for index in 0..=4 * count {
            self.add(index as f64 * step, &mut f)?;
        }
        for index in 0..count {
            let points = [0, 1, 2, 3, 4].map(|k| 4 * index + k);
            let piece = self.piece((4 * index) as f64 * step, 4.0 * step, points);
            self.pieces.push(piece);
        }
        loop {
            let sum: Vec3 = self.pieces.iter().map(|piece| piece.sum).sum();
            let error: f64 = self.pieces.iter().map(|piece| piece.error).sum();
            let worst = self.pieces.iter().map(|piece| piece.error).fold(0.0, f64::max);
            if error <= tolerance * sum.norm() || self.points.len() >= most {
                for piece in &self.pieces {
                    for (point, weight) in piece.points.iter().zip(TWICE) {
                        self.points[*point].weight += weight * piece.length;
                    }
                }
                return Some(Integral { sum, error });
            }
            for index in 0..self.pieces.len() {
                if self.pieces[index].error >= 0.3 * worst {
                    self.split(index, &mut f)?;
                }
            }
        }
    }

    fn add(&mut self, at: f64, f: &mut impl FnMut(f64) -> Option<Vec3>) -> Option<usize> {
        let value = f(at)?;
        self.points.push(Point { value, weight: 0.0 });
        Some(self.points.len() - 1)
    }

    fn piece(&self, begin: f64, length: f64, points: [usize; 5]) -> Piece {
        let sum = |weights: &[f64; 5]| -> Vec3 {
            points.iter().zip(weights).map(|(point, weight)| self.points[*point].value * (weight * length)).sum()
        };
        let (twice, once) = (sum(&TWICE), sum(&ONCE));
        Piece { begin, length, points, sum: twice, error: (twice - once).norm() }
    }

    fn split(&mut self, index: usize, f: &mut impl FnMut(f64) -> Option<Vec3>) -> Option<()> {
        let Piece { begin, length, points: [a, b, c, d, e], .. } = self.pieces[index];
        let at = |k: f64| begin + length * k / 8.0;
        let new = [self.add(at(1.0), f)?, self.add(at(3.0), f)?, self.add(at(5.0), f)?, self.add(at(7.0), f)?];
        self.pieces[index] = self.piece(begin, 0.5 * length, [a, new[0], b, new[1], c]);
        let second = self.piece(begin + 0.5 * length, 0.5 * length, [c, new[2], d, new[3], e]);
        self.pieces.push(second);
        Some(())
    }
}

/// Integrates with one rule. Gives how far, relatively, half the azimuths and the coarser radii are off, or `None` when the patch is not star-shaped.
fn sweep(
    solver: &mut Solver,
    peak: f64,
    azimuths: usize,
    rule: &Rule,
    borders: &mut Vec<f64>,
    nodes: &mut Vec<Node>,
) -> Option<f64> {
    let slice = 2.0 * std::f64::consts::PI / azimuths as f64;
    let center_density = solver.frame.normal * (solver.pair.scale * solver.frame.unit_area());
    let center = solver.column(0.0, 0.0, 0.0)?;
    let mut half = [Vec3::zeros(); 2];
    let mut coarse = Vec3::zeros();
    let direction = |azimuth: usize| {
        // The even azimuths and the odd ones are not each other's mirror image about an axis of the frame: their difference
        // sees the corners of a symmetric patch.
        let angle = slice * azimuth as f64;
        (libm::cos(angle), libm::sin(angle))
    };
    // The first azimuth is solved twice, so that all of a round patch start alike and none errs more than another.
    let (_, mut height) = solver.border(direction(0), peak, 0.0)?;
    for azimuth in 0..azimuths {
        let direction = direction(azimuth);
        let (s, z) = solver.border(direction, peak, height)?;
        height = z;
        borders.push(s);
        let mut line = Vec3::zeros();
        let mut line_coarse = center_density * (center.sum * rule.center);
        for (index, x) in rule.s.iter().enumerate() {
            let r = x * s;
            let column = solver.column(r * direction.0, r * direction.1, z * x * x)?;
            if column.sum < -1e-3 * peak {
                // Out of the contact before its border: there is a bay.
                return None;
            }
            if let Some(node) =
                solver.node(r * direction.0, r * direction.1, &column, rule.weight[index] * s * s * slice)
            {
                line += node.force;
                line_coarse += node.force * (rule.coarse[index] / (rule.weight[index] * s * s * slice));
                nodes.push(node);
            }
        }
        half[azimuth % 2] += line;
        coarse += line_coarse * (s * s * slice);
    }
    let force = half[0] + half[1];
    let size = force.norm();
    if size <= 0.0 {
        return Some(0.0);
    }
    let angular = (half[0] - half[1]).norm() / size;
    let radial = (coarse - force).norm() / size;
    let rounding = 1e-14;
    Some(angular + radial + rounding)
}
