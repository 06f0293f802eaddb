//! Debug drawing into the host's own lines and points.

use std::mem::offset_of;

use libc::{c_void, size_t};

use super::descriptor::{self, Descriptor};
use super::guard::{free, isocoat_world, outside, read};
use super::status::{Refusal, isocoat_status};
use crate::math::Vec3;
use crate::world::draw::{DebugDraw, DrawFlags};

/// What to draw: ISOCOAT_DRAW_ flags, added up.
pub type isocoat_draw_flags = u32;
/// Skeletons as points and wires.
pub const ISOCOAT_DRAW_SKELETONS: isocoat_draw_flags = 1;
/// Seeds as points with normals.
pub const ISOCOAT_DRAW_SEEDS: isocoat_draw_flags = 2;
/// The contacts of the last step: their forces, and discs of their areas.
pub const ISOCOAT_DRAW_CONTACTS: isocoat_draw_flags = 4;
/// The box that bounds the field of each body.
pub const ISOCOAT_DRAW_BOUNDS: isocoat_draw_flags = 8;

const ALL_FLAGS: isocoat_draw_flags =
    ISOCOAT_DRAW_SKELETONS | ISOCOAT_DRAW_SEEDS | ISOCOAT_DRAW_CONTACTS | ISOCOAT_DRAW_BOUNDS;

/// Draws a line.
///
/// - context: as in isocoat_debug_draw.
/// - a, b: 3 doubles each, its ends in the world, in m; valid during the call.
/// - color: 0xRRGGBBAA.
///
/// It must return (no longjmp, no exception). It may read the world, but not change it.
pub type isocoat_draw_line_fn =
    Option<unsafe extern "C" fn(context: *mut c_void, a: *const f64, b: *const f64, color: u32)>;

/// Draws a point.
///
/// - context: as in isocoat_debug_draw.
/// - position: 3 doubles, in the world, in m; valid during the call.
/// - size: the diameter it should have in the scene, in m.
/// - color: 0xRRGGBBAA.
///
/// It must return (no longjmp, no exception). It may read the world, but not change it.
pub type isocoat_draw_point_fn =
    Option<unsafe extern "C" fn(context: *mut c_void, position: *const f64, size: f64, color: u32)>;

/// What to draw and how. Begin with isocoat_debug_draw_default().
#[derive(Clone, Copy, Debug)]
#[repr(C)]
pub struct isocoat_debug_draw {
    /// Size of this struct in bytes, as the host knows it.
    pub struct_size: u32,
    /// ISOCOAT_DRAW_ flags, added up. Default 0, which draws nothing.
    pub flags: isocoat_draw_flags,
    /// Given to the functions, otherwise unused. Default NULL.
    pub context: *mut c_void,
    /// Draws a line; NULL leaves lines out. Default NULL.
    pub draw_line: isocoat_draw_line_fn,
    /// Draws a point; NULL leaves points out. Default NULL.
    pub draw_point: isocoat_draw_point_fn,
}

// SAFETY: `repr(C)`, the size first, integers, a pointer that is never followed, and functions of the host: what is
// not NULL there is a function, as their lines say.
unsafe impl Descriptor for isocoat_debug_draw {
    const NAME: &'static str = "isocoat_debug_draw";
    const FIRST_SIZE: usize = offset_of!(Self, draw_point) + size_of::<isocoat_draw_point_fn>();

    fn defaults() -> Self {
        Self { struct_size: 0, flags: 0, context: std::ptr::null_mut(), draw_line: None, draw_point: None }
    }
}

impl DebugDraw for isocoat_debug_draw {
    fn line(&mut self, a: &Vec3, b: &Vec3, color: u32) {
        if let Some(draw) = self.draw_line {
            // SAFETY: the host's function takes its own context and two times three doubles.
            outside(|| unsafe { draw(self.context, a.as_ptr(), b.as_ptr(), color) });
        }
    }

    fn point(&mut self, p: &Vec3, size: f64, color: u32) {
        if let Some(draw) = self.draw_point {
            // SAFETY: the host's function takes its own context and three doubles.
            outside(|| unsafe { draw(self.context, p.as_ptr(), size, color) });
        }
    }
}

/// Fills a description of what to draw with its defaults; isocoat_debug_draw_default() calls it.
///
/// - draw: receives at most size bytes, its struct_size among them; not NULL.
/// - size: sizeof(isocoat_debug_draw) as the host was compiled.
///
/// Errors: INVALID_ARGUMENT. Threads: any.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn isocoat_debug_draw_init(draw: *mut isocoat_debug_draw, size: size_t) -> isocoat_status {
    // SAFETY: the host gives `size` bytes.
    free(|| unsafe { descriptor::init(draw, size, "draw") })
}

/// Draws what a world sees: its enabled bodies at their present poses.
///
/// - world: not NULL.
/// - draw: what and how; not NULL. Its functions are called before this returns, on this thread.
///
/// Errors: INVALID_ARGUMENT. Threads: reads the world.
#[must_use]
#[unsafe(no_mangle)]
pub unsafe extern "C" fn isocoat_world_debug_draw(
    world: *const isocoat_world,
    draw: *const isocoat_debug_draw,
) -> isocoat_status {
    // SAFETY: the pointers are NULL or as their lines say.
    unsafe {
        read(world, |inner| {
            let mut draw = descriptor::read(draw, "draw")?;
            if draw.flags & !ALL_FLAGS != 0 {
                let message =
                    format!("flags is {:#x}; must be a sum of ISOCOAT_DRAW_ flags, at most {ALL_FLAGS:#x}", draw.flags);
                return Err(Refusal::argument(message));
            }
            inner.world.debug_draw(DrawFlags(draw.flags), &mut draw);
            Ok(())
        })
    }
}
