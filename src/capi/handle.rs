//! Handles: ids by value, one type a noun.

use crate::world::{BodyId, LinkId, SkeletonId, SkinId, SpringId};

/// Handle of a body: one deformable or rigid object. All zero is null. A handle whose body was destroyed, or of
/// another world, gives ISOCOAT_ERROR_INVALID_HANDLE; it never means another body. Only a restore makes it valid again,
/// by bringing its body back.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[repr(C)]
pub struct isocoat_body {
    /// Slot of the body in its world.
    pub index: u32,
    /// How often the slot was used; 0 only in the null handle.
    pub generation: u16,
    /// Tag of the world; 0 only in the null handle.
    pub world: u16,
}

/// Handle of a link: one moving frame of a body. The rules of isocoat_body hold.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[repr(C)]
pub struct isocoat_link {
    /// Slot of the link in its world.
    pub index: u32,
    /// How often the slot was used; 0 only in the null handle.
    pub generation: u16,
    /// Tag of the world; 0 only in the null handle.
    pub world: u16,
}

/// Handle of a skeleton: a primitive, fixed in a link's frame, that emits a field. The rules of isocoat_body hold.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[repr(C)]
pub struct isocoat_skeleton {
    /// Slot of the skeleton in its world.
    pub index: u32,
    /// How often the slot was used; 0 only in the null handle.
    pub generation: u16,
    /// Tag of the world; 0 only in the null handle.
    pub world: u16,
}

/// Handle of a spring between two links of a body. The rules of isocoat_body hold.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[repr(C)]
pub struct isocoat_spring {
    /// Slot of the spring in its world.
    pub index: u32,
    /// How often the slot was used; 0 only in the null handle.
    pub generation: u16,
    /// Tag of the world; 0 only in the null handle.
    pub world: u16,
}

/// Handle of a skin: a mesh of the host that a body's coat carries. The rules of isocoat_body hold; but a restore brings
/// no skin back.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[repr(C)]
pub struct isocoat_skin {
    /// Slot of the skin in its world.
    pub index: u32,
    /// How often the slot was used; 0 only in the null handle.
    pub generation: u16,
    /// Tag of the world; 0 only in the null handle.
    pub world: u16,
}

macro_rules! converts {
    ($handle:ty, $id:ty) => {
        impl From<$handle> for $id {
            fn from(handle: $handle) -> Self {
                let mut id = Self::default();
                (id.raw.index, id.raw.generation, id.raw.world) = (handle.index, handle.generation, handle.world);
                id
            }
        }
        impl From<$id> for $handle {
            fn from(id: $id) -> Self {
                Self { index: id.raw.index, generation: id.raw.generation, world: id.raw.world }
            }
        }
    };
}
converts!(isocoat_body, BodyId);
converts!(isocoat_link, LinkId);
converts!(isocoat_skeleton, SkeletonId);
converts!(isocoat_spring, SpringId);
converts!(isocoat_skin, SkinId);
