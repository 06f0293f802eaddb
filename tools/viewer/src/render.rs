//! Pictures by the library's ray query: a ray a pixel and more where neighbours differ, one towards the lamp.

use isocoat::World;
use isocoat::field::Shape;
use isocoat::math::Vec3;
use isocoat::world::query::RayHit;
use isocoat::world::rays::{Ray, RayGoal};
use isocoat::world::sight::{Inside, Sight};
use rayon::prelude::*;

use crate::view::{Cut, Paint, View};

/// Red, green, blue, from 0 to 1.
type Colour = Vec3;

/// A finished picture: three bytes a pixel, row by row.
pub struct Picture {
    pub size: [u32; 2],
    pub pixels: Vec<[u8; 3]>,
}

/// Steps of brightness: few enough that even surfaces take little room in a file.
const LEVELS: f64 = 56.0;
/// Where neighbours differ by more, a pixel is looked at more closely.
const CONTRAST: f64 = 0.06;
const LINE: Colour = Colour::new(0.13, 0.13, 0.16);
const CONTACT: Colour = Colour::new(0.85, 0.1, 0.08);

pub fn render(world: &World, view: &View) -> isocoat::Result<Picture> {
    let hidden = world.bodies().filter(|body| view.hidden.contains(&body.raw.index));
    let sight = hidden.fold(world.sight(u64::MAX, view.deformation), |sight, body| sight.without(body));
    let scene = Scene { world, sight, view };
    let [width, height] = view.size;
    let rows: Vec<Vec<Colour>> = (0..height)
        .into_par_iter()
        .map_init(
            || scene.clone(),
            |scene, y| (0..width).map(|x| scene.look(f64::from(x) + 0.5, f64::from(y) + 0.5)).collect(),
        )
        .collect::<isocoat::Result<_>>()?;
    let refined: Vec<Vec<Colour>> = (0..height as usize)
        .into_par_iter()
        .map_init(|| scene.clone(), |scene, y| (0..width as usize).map(|x| scene.refine(&rows, x, y)).collect())
        .collect::<isocoat::Result<_>>()?;
    Ok(Picture { size: view.size, pixels: refined.into_iter().flatten().map(bytes).collect() })
}

/// After a curve as screens have it, the brightest of the three rounded to the steps: so all shades have one hue.
fn bytes(colour: Colour) -> [u8; 3] {
    let seen = colour.map(|x| x.clamp(0.0, 1.0).powf(1.0 / 1.6));
    let brightest = seen.max().max(f64::MIN_POSITIVE);
    let rounded = seen * ((brightest * LEVELS).round() / LEVELS / brightest * 255.0);
    [rounded.x, rounded.y, rounded.z].map(|x| x.round() as u8)
}

#[derive(Clone)]
struct Scene<'a> {
    world: &'a World,
    sight: Sight<'a>,
    view: &'a View,
}

impl Scene<'_> {
    fn refine(&mut self, rows: &[Vec<Colour>], x: usize, y: usize) -> isocoat::Result<Colour> {
        let own = rows[y][x];
        let near = [(x.wrapping_sub(1), y), (x + 1, y), (x, y.wrapping_sub(1)), (x, y + 1)];
        let others = near.iter().filter_map(|(x, y)| rows.get(*y)?.get(*x));
        if others.map(|other| (other - own).amax()).fold(0.0, f64::max) < CONTRAST {
            return Ok(own);
        }
        let mut sum = own;
        // A square turned a little, so that edges of any direction get all shades.
        let places = [(0.125, 0.375), (0.375, 0.875), (0.625, 0.125), (0.875, 0.625)];
        for (dx, dy) in places {
            sum += self.look(x as f64 + dx, y as f64 + dy)?;
        }
        Ok(sum / 5.0)
    }

    /// What is seen through a point of the picture.
    fn look(&mut self, x: f64, y: f64) -> isocoat::Result<Colour> {
        let direction = self.view.ray(x, y).normalize();
        let mut start = self.view.eye;
        if let Some(cut) = self.view.cut {
            let ahead = cut.distance - cut.normal.dot(&start);
            let slope = cut.normal.dot(&direction);
            if ahead < 0.0 {
                // The eye is on the side that is left out.
                if slope >= 0.0 {
                    return Ok(sky(&direction));
                }
                start += direction * (ahead / slope);
                if let Some(inside) = self.sight.inside(&start)? {
                    return self.section(&start, &inside, &cut);
                }
            }
        }
        let ray = Ray { origin: start, direction, max_distance: f64::INFINITY };
        match self.sight.cast_ray(&ray, RayGoal::Closest)? {
            Some(hit) => self.shade(&hit, &direction),
            None => Ok(sky(&direction)),
        }
    }

    /// The inside of a solid: shells of equal depth, its outline, and where it touches another.
    fn section(&self, at: &Vec3, inside: &Inside, cut: &Cut) -> isocoat::Result<Colour> {
        let pixel = self.view.pixel(at);
        let side = if cut.normal.z.abs() < 0.9 { Vec3::z() } else { Vec3::x() }.cross(&cut.normal).normalize();
        let other = cut.normal.cross(&side);
        if inside.depth < 1.6 * pixel {
            for way in [side, -side, other, -other] {
                let near = self.sight.inside(&(at + way * (2.5 * pixel)))?;
                let Some(near) = near.filter(|near| near.body != inside.body) else { continue };
                return Ok(match self.view.paint {
                    // What presses, by the softer of the two, as the other may be rigid.
                    Paint::Pressure(most) => heat(inside.pressure.max(near.pressure) / most),
                    _ => CONTACT,
                });
            }
            return Ok(LINE);
        }
        let base = self.body_colour(inside.body);
        let shell = (inside.depth / (12.0 * pixel)).fract();
        Ok(base * if shell < 0.12 { 0.78 } else { 0.92 })
    }

    fn shade(&mut self, hit: &RayHit, direction: &Vec3) -> isocoat::Result<Colour> {
        let lamp = Vec3::new(0.35, -0.5, 0.8).normalize();
        let normal = hit.normal;
        let facing = normal.dot(&lamp);
        let start = hit.position + normal * (0.6 * self.view.pixel(&hit.position));
        let to_lamp = Ray { origin: start, direction: lamp, max_distance: f64::INFINITY };
        let lit = facing > 0.0 && self.sight.cast_ray(&to_lamp, RayGoal::Any)?.is_none();
        let base = self.colour(hit);
        // Sky from above, a little from the ground, the lamp, and its mirror image.
        let ambient = 0.30 + 0.14 * normal.z;
        let mirror = direction - normal * (2.0 * direction.dot(&normal));
        let gloss = if lit { 0.16 * mirror.dot(&lamp).max(0.0).powi(24) } else { 0.0 };
        let light = ambient + if lit { 0.62 * facing } else { 0.0 };
        let seen = base * light + Vec3::repeat(gloss);
        // The ground fades into the sky.
        let far = (hit.position - self.view.target).norm() / self.view.width;
        let fade = if self.is_ground(hit) { ((far - 1.2) / 2.5).clamp(0.0, 1.0) } else { 0.0 };
        Ok(seen.lerp(&sky(direction), fade))
    }

    fn is_ground(&self, hit: &RayHit) -> bool {
        self.world.skeleton_desc(hit.skeleton).is_ok_and(|desc| matches!(desc.shape, Shape::Plane { .. }))
    }

    fn colour(&self, hit: &RayHit) -> Colour {
        if self.is_ground(hit) {
            // Squares of a round length, some ten in the picture.
            let length = 10f64.powf((self.view.width / 2.0).log10().round()) / 4.0;
            let even =
                [hit.position.x, hit.position.y].map(|x| (x / length).floor() as i64).iter().sum::<i64>() % 2 == 0;
            return Colour::repeat(if even { 0.60 } else { 0.50 });
        }
        if let Paint::Pressure(most) = self.view.paint {
            let pressure = self.sight.pressure(hit) / most;
            // On a free surface it is zero but for rounding.
            if pressure > 1e-6 {
                return heat(pressure);
            }
        }
        match self.view.paint {
            Paint::Skeletons if self.world.skeleton_desc(hit.skeleton).is_ok() => palette(hit.skeleton.raw.index),
            _ => self.body_colour(hit.body),
        }
    }

    fn body_colour(&self, body: isocoat::world::BodyId) -> Colour {
        match self.world.body_desc(body) {
            Ok(desc) if desc.rigid => Colour::new(0.50, 0.54, 0.60),
            _ => palette(body.raw.index),
        }
    }
}

/// Colours that are told apart.
fn palette(index: u32) -> Colour {
    const COLOURS: [[f64; 3]; 8] = [
        [0.80, 0.42, 0.26],
        [0.30, 0.55, 0.72],
        [0.84, 0.66, 0.30],
        [0.42, 0.62, 0.36],
        [0.66, 0.40, 0.62],
        [0.86, 0.52, 0.50],
        [0.36, 0.62, 0.62],
        [0.62, 0.58, 0.34],
    ];
    Colour::from(COLOURS[index as usize % COLOURS.len()])
}

/// From blue over yellow to red, for 0 to 1.
fn heat(x: f64) -> Colour {
    let x = x.clamp(0.0, 1.0);
    let (cold, warm, hot) =
        (Colour::new(0.16, 0.32, 0.72), Colour::new(0.95, 0.80, 0.25), Colour::new(0.82, 0.10, 0.08));
    if x < 0.5 { cold.lerp(&warm, 2.0 * x) } else { warm.lerp(&hot, 2.0 * x - 1.0) }
}

fn sky(direction: &Vec3) -> Colour {
    Colour::new(0.84, 0.87, 0.91) * (0.94 + 0.1 * (0.5 + direction.z).clamp(0.0, 1.0))
}
