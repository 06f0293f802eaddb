//! Storage behind handles: a slot table whose ids stay invalid for ever once their object is destroyed.

use std::marker::PhantomData;

use crate::error::{Error, Result};

/// An id: slot, generation of the slot, and tag of the world. The all-zero id is null.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord, Hash)]
#[repr(C)]
pub struct RawId {
    /// Slot number.
    pub index: u32,
    /// Odd or even alike, but never zero for a live object.
    pub generation: u16,
    /// Tag of the world the object belongs to; never zero.
    pub world: u16,
}

/// A noun that lives in an arena.
pub trait Noun {
    /// How messages call it.
    const NAME: &'static str;
}

/// A typed handle.
pub struct Id<T> {
    /// The untyped id, as the C handles carry it.
    pub raw: RawId,
    noun: PhantomData<fn() -> T>,
}

impl<T> Id<T> {
    /// Types an id that came from outside. Nothing is checked until it is used.
    pub fn from_raw(raw: RawId) -> Self {
        Self { raw, noun: PhantomData }
    }

    pub(crate) fn index(self) -> usize {
        self.raw.index as usize
    }
}

// Not derived: a derive would ask the same of `T`.
impl<T> Clone for Id<T> {
    fn clone(&self) -> Self {
        *self
    }
}
impl<T> Copy for Id<T> {}
impl<T> Default for Id<T> {
    fn default() -> Self {
        Self::from_raw(RawId::default())
    }
}
impl<T> PartialEq for Id<T> {
    fn eq(&self, other: &Self) -> bool {
        self.raw == other.raw
    }
}
impl<T> Eq for Id<T> {}
impl<T> PartialOrd for Id<T> {
    fn partial_cmp(&self, other: &Self) -> Option<std::cmp::Ordering> {
        Some(self.cmp(other))
    }
}
impl<T> Ord for Id<T> {
    fn cmp(&self, other: &Self) -> std::cmp::Ordering {
        self.raw.cmp(&other.raw)
    }
}
impl<T> std::hash::Hash for Id<T> {
    fn hash<H: std::hash::Hasher>(&self, state: &mut H) {
        self.raw.hash(state);
    }
}
impl<T> std::fmt::Debug for Id<T> {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "{}.{}@{}", self.raw.index, self.raw.generation, self.raw.world)
    }
}

struct Slot<T> {
    generation: u16,
    value: Option<T>,
}

/// The slot table of one noun.
pub(crate) struct Arena<T> {
    world: u16,
    slots: Vec<Slot<T>>,
    free: Vec<u32>,
    live: usize,
}

impl<T: Noun> Arena<T> {
    pub fn new(world: u16) -> Self {
        Self { world, slots: Vec::new(), free: Vec::new(), live: 0 }
    }

    pub fn len(&self) -> usize {
        self.live
    }

    pub fn insert(&mut self, value: T) -> Result<Id<T>> {
        let index = match self.free.pop() {
            Some(index) => index,
            None => {
                let index = u32::try_from(self.slots.len())
                    .map_err(|_| Error::Capacity("too many objects: a world holds at most 2^32 of a kind"))?;
                self.slots.push(Slot { generation: 1, value: None });
                index
            }
        };
        let slot = &mut self.slots[index as usize];
        slot.value = Some(value);
        self.live += 1;
        Ok(Id::from_raw(RawId { index, generation: slot.generation, world: self.world }))
    }

    pub fn remove(&mut self, id: Id<T>) -> Result<T> {
        self.check(id)?;
        let slot = &mut self.slots[id.index()];
        self.live -= 1;
        // A slot whose generations are used up is retired, so that no stale handle ever fits again.
        if slot.generation < u16::MAX {
            slot.generation += 1;
            self.free.push(id.raw.index);
        }
        slot.value.take().ok_or(Error::InvalidHandle { noun: T::NAME, reason: "it was destroyed" })
    }

    pub fn get(&self, id: Id<T>) -> Result<&T> {
        self.check(id)?;
        Ok(&self[id.index()])
    }

    pub fn get_mut(&mut self, id: Id<T>) -> Result<&mut T> {
        self.check(id)?;
        Ok(&mut self[id.index()])
    }

    /// The id of the object in a slot that is known to be live.
    pub fn id_of(&self, index: usize) -> Id<T> {
        let generation = self.slots[index].generation;
        Id::from_raw(RawId { index: index as u32, generation, world: self.world })
    }

    /// Slots that hold an object, in order.
    pub fn indices(&self) -> impl Iterator<Item = usize> + '_ {
        self.slots.iter().enumerate().filter(|(_, slot)| slot.value.is_some()).map(|(index, _)| index)
    }

    /// Whether a slot holds an object.
    pub fn is_live(&self, index: usize) -> bool {
        self.slots.get(index).is_some_and(|slot| slot.value.is_some())
    }

    /// Number of slots, live or not.
    pub fn capacity(&self) -> usize {
        self.slots.len()
    }

    fn check(&self, id: Id<T>) -> Result<()> {
        let invalid = |reason| Err(Error::InvalidHandle { noun: T::NAME, reason });
        if id.raw == RawId::default() {
            return invalid("the handle is null");
        }
        if id.raw.world != self.world {
            return invalid("the handle belongs to another world");
        }
        match self.slots.get(id.index()) {
            Some(slot) if slot.generation == id.raw.generation && slot.value.is_some() => Ok(()),
            Some(_) => invalid("the handle is stale: its object was destroyed"),
            None => invalid("the handle was never given out"),
        }
    }
}

impl<T> std::ops::Index<usize> for Arena<T> {
    type Output = T;
    fn index(&self, index: usize) -> &T {
        self.slots[index].value.as_ref().expect("internal index of a live object")
    }
}

impl<T> std::ops::IndexMut<usize> for Arena<T> {
    fn index_mut(&mut self, index: usize) -> &mut T {
        self.slots[index].value.as_mut().expect("internal index of a live object")
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    impl Noun for u8 {
        const NAME: &'static str = "byte";
    }

    #[test]
    fn stale_foreign_and_null_handles_are_told_apart() {
        let (mut ours, mut theirs) = (Arena::<u8>::new(1), Arena::<u8>::new(2));
        let id = ours.insert(7).unwrap();
        assert_eq!(*ours.get(id).unwrap(), 7);
        let foreign = theirs.insert(8).unwrap();
        assert!(ours.get(foreign).unwrap_err().to_string().contains("another world"));
        assert!(ours.get(Id::default()).unwrap_err().to_string().contains("null"));
        ours.remove(id).unwrap();
        assert!(ours.get(id).unwrap_err().to_string().contains("stale"));
        let reused = ours.insert(9).unwrap();
        assert_eq!(reused.raw.index, id.raw.index);
        assert!(ours.get(id).is_err() && ours.remove(id).is_err());
        assert_eq!(ours.len(), 1);
    }

    #[test]
    fn a_slot_is_retired_when_its_generations_are_used_up() {
        let mut arena = Arena::<u8>::new(1);
        let first = arena.insert(0).unwrap();
        arena.remove(first).unwrap();
        for _ in 1..u16::MAX {
            let id = arena.insert(0).unwrap();
            assert_eq!(id.raw.index, 0);
            arena.remove(id).unwrap();
        }
        assert_eq!(arena.insert(0).unwrap().raw.index, 1);
        assert!(arena.get(first).is_err());
    }
}
