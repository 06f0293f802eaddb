//! Version and ABI: what the host was compiled with against what it runs with.

use libc::{c_char, size_t};

use super::descriptor::Descriptor;
use super::guard::free;
use super::pointer::Array;
use super::status::{Checked, ISOCOAT_ERROR_UNSUPPORTED, Refusal, isocoat_status};

const fn number(text: &str) -> u32 {
    let (bytes, mut index, mut value) = (text.as_bytes(), 0, 0);
    while index < bytes.len() {
        value = value * 10 + (bytes[index] - b'0') as u32;
        index += 1;
    }
    value
}

const MAJOR: u32 = number(env!("CARGO_PKG_VERSION_MAJOR"));
const MINOR: u32 = number(env!("CARGO_PKG_VERSION_MINOR"));
const PATCH: u32 = number(env!("CARGO_PKG_VERSION_PATCH"));

const fn pack(major: u32, minor: u32, patch: u32) -> u32 {
    major << 22 | minor << 12 | patch
}

/// The version of the library that runs, as ISOCOAT_VERSION packs it: major << 22 | minor << 12 | patch.
///
/// Threads: any.
#[unsafe(no_mangle)]
pub extern "C" fn isocoat_version() -> u32 {
    pack(MAJOR, MINOR, PATCH)
}

/// The version of the library that runs, such as "0.1.0".
///
/// Lifetime: static. Threads: any.
#[unsafe(no_mangle)]
pub extern "C" fn isocoat_version_string() -> *const c_char {
    concat!(env!("CARGO_PKG_VERSION"), "\0").as_ptr().cast()
}

/// Size of a struct, and whether a host may have a smaller or a larger one.
struct Layout {
    name: &'static str,
    size: usize,
    /// Smallest size of one that says its size itself.
    growable_from: Option<usize>,
}

const fn fixed<T>(name: &'static str) -> Layout {
    Layout { name, size: size_of::<T>(), growable_from: None }
}

const fn growable<T: Descriptor>() -> Layout {
    Layout { name: T::NAME, size: size_of::<T>(), growable_from: Some(T::FIRST_SIZE) }
}

/// In the order in which `isocoat_check_abi` gives them. Only ever extended at the end.
const LAYOUTS: &[Layout] = &[
    fixed::<super::handle::isocoat_body>("isocoat_body"),
    fixed::<super::math::isocoat_pose>("isocoat_pose"),
    fixed::<super::math::isocoat_wrench>("isocoat_wrench"),
    fixed::<super::motion::isocoat_link_state>("isocoat_link_state"),
    fixed::<super::buffer::isocoat_buffer>("isocoat_buffer"),
    fixed::<super::report::isocoat_contact>("isocoat_contact"),
    fixed::<super::report::isocoat_event>("isocoat_event"),
    growable::<super::report::isocoat_counters>(),
    growable::<super::world::isocoat_world_desc>(),
    growable::<super::body::isocoat_body_desc>(),
    growable::<super::link::isocoat_link_desc>(),
    growable::<super::skeleton::isocoat_skeleton_desc>(),
    fixed::<super::query::isocoat_ray_hit>("isocoat_ray_hit"),
    fixed::<super::query::isocoat_surface_point>("isocoat_surface_point"),
    growable::<super::draw::isocoat_debug_draw>(),
    growable::<super::report::isocoat_times>(),
    growable::<super::spring::isocoat_spring_desc>(),
    fixed::<super::spring::isocoat_spring_state>("isocoat_spring_state"),
    growable::<super::substance::isocoat_substance_desc>(),
    fixed::<super::piece::isocoat_piece>("isocoat_piece"),
    fixed::<super::piece::isocoat_change>("isocoat_change"),
    growable::<super::mesh::isocoat_mesh_desc>(),
    fixed::<super::mesh::isocoat_mesh_view>("isocoat_mesh_view"),
    growable::<super::recording::isocoat_recorder_desc>(),
    fixed::<super::buffer::isocoat_const_buffer>("isocoat_const_buffer"),
    growable::<super::rays::isocoat_rays_desc>(),
    growable::<super::rays::isocoat_ray_hits>(),
    growable::<super::fit::isocoat_fit_desc>(),
    fixed::<super::fit::isocoat_fit_distance>("isocoat_fit_distance"),
];

/// What isocoat_check_abi calls: compares a host's version and struct sizes with the library's.
///
/// - version: ISOCOAT_VERSION of the header that the host was compiled with.
/// - sizes: sizeof of the structs, in the header's order; not NULL unless count is 0.
/// - count: number of sizes; a count other than this library's own compares what both know.
///
/// Errors: UNSUPPORTED when they do not fit together; INVALID_ARGUMENT. Threads: any.
#[must_use]
#[unsafe(no_mangle)]
pub unsafe extern "C" fn isocoat_check_abi_of(version: u32, sizes: *const u32, count: size_t) -> isocoat_status {
    free(|| {
        // SAFETY: the host gives `count` sizes.
        let sizes = unsafe { Array::new(sizes, count, "sizes") }?;
        check_version(version)?;
        LAYOUTS.iter().zip(sizes.iter()).try_for_each(|(layout, size)| check_layout(layout, size as usize))
    })
}

/// The same major version, and of 0.x the same minor; the host's header not newer than the library's.
fn check_version(version: u32) -> Checked<()> {
    let (major, minor, patch) = (version >> 22, version >> 12 & 0x3ff, version & 0xfff);
    if major == MAJOR && (minor == MINOR || major > 0 && minor < MINOR) {
        return Ok(());
    }
    let message = format!(
        "the host was compiled with isocoat {major}.{minor}.{patch}; this library is {MAJOR}.{MINOR}.{PATCH}, and \
         serves hosts of {MAJOR}.{first}.0 to {MAJOR}.{MINOR}.x",
        first = if MAJOR == 0 { MINOR } else { 0 },
    );
    Err(Refusal::new(ISOCOAT_ERROR_UNSUPPORTED, message))
}

fn check_layout(layout: &Layout, size: usize) -> Checked<()> {
    if layout.growable_from.map_or(size == layout.size, |first| size >= first) {
        return Ok(());
    }
    let at_least = if layout.growable_from.is_some() { "at least " } else { "" };
    let expected = layout.growable_from.unwrap_or(layout.size);
    let message =
        format!("sizeof({}) is {size} in the host; must be {at_least}{expected}: check its packing", layout.name);
    Err(Refusal::new(ISOCOAT_ERROR_UNSUPPORTED, message))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn versions_that_do_not_fit_are_told() {
        assert!(check_version(isocoat_version()).is_ok());
        assert!(check_version(pack(MAJOR, MINOR, PATCH + 1)).is_ok());
        let message = check_version(pack(MAJOR + 1, 2, 3)).unwrap_err().message;
        assert!(message.contains(&format!("{}.2.3", MAJOR + 1)), "{message}");
        assert!(check_version(pack(MAJOR, MINOR + 1, 0)).is_err());
    }

    #[test]
    fn sizes_that_do_not_fit_are_told() {
        let fixed = Layout { name: "isocoat_x", size: 24, growable_from: None };
        assert!(check_layout(&fixed, 24).is_ok());
        assert!(
            check_layout(&fixed, 20).unwrap_err().message.contains("sizeof(isocoat_x) is 20 in the host; must be 24")
        );
        let growable = Layout { name: "isocoat_y", size: 40, growable_from: Some(32) };
        assert!(check_layout(&growable, 32).is_ok() && check_layout(&growable, 48).is_ok());
        assert!(check_layout(&growable, 24).unwrap_err().message.contains("at least 32"));
    }
}
