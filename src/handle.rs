//! Storage behind handles: a slot table whose ids stay invalid for ever once their object is destroyed.

use std::marker::PhantomData;
use std::sync::{Mutex, MutexGuard, PoisonError};

use crate::error::{Error, Result, out_of_range};

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

/// A place for an object.
pub(crate) struct Slot<T> {
    /// That of the object in it, or of the last one.
    pub generation: u16,
    pub value: Option<T>,
}

/// The slot table of one noun.
pub(crate) struct Arena<T> {
    world: u16,
    slots: Vec<Slot<T>>,
    /// Empty slots; the last is used next.
    free: Vec<u32>,
    live: usize,
    /// The last generation that each slot has ever given out: as many as slots, or more after a rollback. It is never
    /// taken back, so that a handle from a future that did not come to pass never fits another object.
    given: Vec<u16>,
}

impl<T: Noun> Arena<T> {
    pub fn new(world: u16) -> Self {
        Self { world, slots: Vec::new(), free: Vec::new(), live: 0, given: Vec::new() }
    }

    /// The arena of slots and a free list from outside, or why they make none. `given` is as long as `slots`.
    pub fn from_parts(world: u16, slots: Vec<Slot<T>>, free: Vec<u32>, given: Vec<u16>) -> Result<Self> {
        let live = slots.iter().filter(|slot| slot.value.is_some()).count();
        for (slot, given) in slots.iter().zip(&given) {
            if slot.value.is_some() && !(1..=*given).contains(&slot.generation) {
                return Err(out_of_range("generation of a slot", slot.generation, "from 1 to the last given out"));
            }
        }
        let mut is_free = vec![false; slots.len()];
        for index in &free {
            match (slots.get(*index as usize), is_free.get_mut(*index as usize)) {
                (Some(Slot { value: None, .. }), Some(listed)) if !*listed => *listed = true,
                _ => return Err(out_of_range("free slot", index, "the number of an empty slot, each once")),
            }
        }
        Ok(Self { world, slots, free, live, given })
    }

    /// The slots, the free list, and the last generations given out by these slots.
    pub fn parts(&self) -> (&[Slot<T>], &[u32], &[u16]) {
        let Self { world: _, slots, free, live: _, given } = self;
        (slots, free, &given[..slots.len()])
    }

    /// Takes care that no generation is given out that another arena of the same world has given out already.
    pub fn go_on_from(&mut self, other: &Self) {
        self.given.resize(self.given.len().max(other.given.len()), 0);
        for (given, other) in self.given.iter_mut().zip(&other.given) {
            *given = (*given).max(*other);
        }
    }

    pub fn len(&self) -> usize {
        self.live
    }

    pub fn insert(&mut self, value: T) -> Result<Id<T>> {
        let index = self.empty_slot()?;
        let (slot, given) = (&mut self.slots[index as usize], &mut self.given[index as usize]);
        *given += 1;
        *slot = Slot { generation: *given, value: Some(value) };
        self.live += 1;
        Ok(Id::from_raw(RawId { index, generation: *given, world: self.world }))
    }

    /// An empty slot that has generations left. One whose generations are used up is retired, so that no stale handle
    /// ever fits again.
    fn empty_slot(&mut self) -> Result<u32> {
        loop {
            let index = match self.free.pop() {
                Some(index) => index,
                None => {
                    let index = u32::try_from(self.slots.len())
                        .map_err(|_| Error::Capacity("too many objects: a world holds at most 2^32 of a kind"))?;
                    self.slots.push(Slot { generation: 0, value: None });
                    self.given.resize(self.given.len().max(self.slots.len()), 0);
                    index
                }
            };
            if self.given[index as usize] < u16::MAX {
                return Ok(index);
            }
        }
    }

    pub fn remove(&mut self, id: Id<T>) -> Result<T> {
        self.check(id)?;
        self.live -= 1;
        self.free.push(id.raw.index);
        self.slots[id.index()].value.take().ok_or(Error::InvalidHandle { noun: T::NAME, reason: "it was destroyed" })
    }

    pub fn get(&self, id: Id<T>) -> Result<&T> {
        self.check(id)?;
        Ok(&self[id.index()])
    }

    pub fn get_mut(&mut self, id: Id<T>) -> Result<&mut T> {
        self.check(id)?;
        Ok(&mut self[id.index()])
    }

    /// Gives the objects to a world: handles with its tag now stand for them, others no longer do.
    pub fn set_world(&mut self, world: u16) {
        self.world = world;
    }

    /// The object in a slot, if there is one.
    pub fn at_mut(&mut self, index: usize) -> Option<&mut T> {
        self.slots.get_mut(index).and_then(|slot| slot.value.as_mut())
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

/// The tag that tells one world's handles from those of all others that live: with it, the only process-wide state.
#[derive(Debug)]
pub(crate) struct WorldTag(u16);

struct Tags {
    /// A bit a tag.
    live: [u64; 1024],
    /// Where the search for a free one begins, so that a tag rests as long as possible.
    next: u16,
}

static TAGS: Mutex<Tags> = Mutex::new(Tags { live: [0; 1024], next: 1 });

fn tags() -> MutexGuard<'static, Tags> {
    // Nothing panics while the lock is held.
    TAGS.lock().unwrap_or_else(PoisonError::into_inner)
}

impl WorldTag {
    /// Takes a tag that no living world has.
    pub fn take() -> Result<Self> {
        let mut tags = tags();
        for step in 0..=u16::MAX {
            let tag = tags.next.wrapping_add(step);
            let (word, bit) = (usize::from(tag / 64), 1 << (tag % 64));
            if tag != 0 && tags.live[word] & bit == 0 {
                tags.live[word] |= bit;
                tags.next = tag.wrapping_add(1);
                return Ok(Self(tag));
            }
        }
        Err(Error::Capacity("65535 worlds live already"))
    }

    /// The tag as it stands in handles.
    pub fn number(&self) -> u16 {
        self.0
    }
}

impl Drop for WorldTag {
    fn drop(&mut self) {
        tags().live[usize::from(self.0 / 64)] &= !(1 << (self.0 % 64));
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn no_two_living_worlds_share_a_tag() {
        let held = WorldTag::take().unwrap();
        for _ in 0..70_000 {
            assert_ne!(WorldTag::take().unwrap().number(), held.number());
        }
    }

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

    #[test]
    fn a_handle_from_before_a_rollback_never_means_another_object() {
        let mut before = Arena::<u8>::new(1);
        let kept = before.insert(0).unwrap();
        let gone = before.insert(1).unwrap();
        let copy = |arena: &Arena<u8>| {
            let (slots, free, given) = arena.parts();
            let slots = slots.iter().map(|Slot { generation, value }| Slot { generation: *generation, value: *value });
            Arena::from_parts(1, slots.collect(), free.to_vec(), given.to_vec()).unwrap()
        };
        let mut after = copy(&before);
        after.remove(gone).unwrap();
        let undone = [after.insert(2).unwrap(), after.insert(3).unwrap(), after.insert(4).unwrap()];
        let mut back = copy(&before);
        back.go_on_from(&after);
        assert_eq!((*back.get(kept).unwrap(), *back.get(gone).unwrap()), (0, 1));
        back.remove(gone).unwrap();
        for value in 5..9 {
            let fresh = back.insert(value).unwrap();
            assert!(undone.iter().all(|id| *id != fresh && back.get(*id).is_err()));
        }
        // The slots are those that it would have taken without the rollback.
        assert_eq!(back.len(), 5);
        assert_eq!(back.capacity(), 5);
    }
}
