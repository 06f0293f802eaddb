//! How a scene is looked at: camera, light, cut, colours.

use isocoat::math::Vec3;
use isocoat::world::Deformation;

/// What colours mean.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Paint {
    /// A colour for each body.
    Bodies,
    /// A colour for each skeleton.
    Skeletons,
    /// Pressure of contacts, up to this [Pa]; elsewhere that of the body.
    Pressure(f64),
}

/// A plane through the scene: what lies on the side of its normal is left out.
#[derive(Clone, Copy, Debug)]
pub struct Cut {
    pub normal: Vec3,
    pub distance: f64,
}

#[derive(Clone, Debug)]
pub struct View {
    pub eye: Vec3,
    pub target: Vec3,
    /// Width of what is seen at the target [m].
    pub width: f64,
    /// Pixels.
    pub size: [u32; 2],
    pub deformation: Deformation,
    pub paint: Paint,
    pub cut: Option<Cut>,
    /// Bodies that are not shown, by the index of their handles.
    pub hidden: Vec<u32>,
}

impl Default for View {
    fn default() -> Self {
        Self {
            eye: Vec3::new(1.5, -2.5, 1.5),
            target: Vec3::zeros(),
            width: 2.0,
            size: [480, 360],
            deformation: Deformation::Bulges,
            paint: Paint::Bodies,
            cut: None,
            hidden: Vec::new(),
        }
    }
}

impl View {
    /// Direction of the ray through a point of the picture, in pixels from its upper left corner; of length 1 at the
    /// distance of the target.
    pub fn ray(&self, x: f64, y: f64) -> Vec3 {
        let forward = self.target - self.eye;
        let ahead = forward.normalize();
        let up = if ahead.z.abs() > 0.999 { Vec3::y() } else { Vec3::z() };
        let right = ahead.cross(&up).normalize();
        let above = right.cross(&ahead);
        let scale = self.width / f64::from(self.size[0]);
        let (across, rise) = (x - 0.5 * f64::from(self.size[0]), 0.5 * f64::from(self.size[1]) - y);
        forward + right * (across * scale) + above * (rise * scale)
    }

    /// Width of a pixel at a point [m].
    pub fn pixel(&self, at: &Vec3) -> f64 {
        self.width / f64::from(self.size[0]) * (at - self.eye).norm() / (self.target - self.eye).norm()
    }
}
