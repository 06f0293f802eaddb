//! Frames as few bytes, without loss: what differs from what the last two frames let expect.
//!
//! A number is expected on a straight line through its last two values. As places on the row of all doubles, the two
//! are close: their distance takes as many bytes as it needs, and half a byte says how many. Labels and pieces are
//! written where they change.

use crate::substance::Bond;

/// What of a world's shape changes from frame to frame, in an order that its structure gives.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Moment {
    /// Poses of links; offsets of skeletons; weights of blends; places, offsets and volumes of particles.
    pub numbers: Vec<f64>,
    /// Label and piece of each particle.
    pub counts: Vec<u32>,
    /// Bonds of each substance, in order.
    pub bonds: Vec<Vec<Bond>>,
}

/// Appends a frame. `past` has the frame before and the one before that, as far as they count.
pub fn pack(now: &Moment, past: &[&Moment], out: &mut Vec<u8>) {
    for (pair, numbers) in now.numbers.chunks(2).enumerate() {
        let head = out.len();
        out.push(0);
        for (half, number) in numbers.iter().enumerate() {
            let expected = expect(past.iter().map(|moment| moment.numbers[2 * pair + half]), 0.0);
            out[head] |= put_distance(*number, expected, out) << (4 * half);
        }
    }
    let before = |at: usize| past.first().map_or(0, |moment| moment.counts[at]);
    let changes = || now.counts.iter().enumerate().filter(|(at, count)| before(*at) != **count);
    put_count(changes().count() as u64, out);
    let mut next = 0;
    for (at, count) in changes() {
        put_count((at - next) as u64, out);
        put_count(zigzag(i64::from(*count) - i64::from(before(at))), out);
        next = at + 1;
    }
    for (list, bonds) in now.bonds.iter().enumerate() {
        put_count(bonds.len() as u64, out);
        let mut first = 0;
        for bond in bonds {
            put_count(u64::from(bond.pair[0] - first), out);
            put_count(u64::from(bond.pair[1] - bond.pair[0]), out);
            first = bond.pair[0];
            let head = out.len();
            out.push(u8::from(bond.holds) << 4);
            out[head] |= put_distance(bond.progress, expect_bond(bond.pair, bond.holds, list, past), out);
        }
    }
}

/// Reads a frame in place of `now`, whose lists have the lengths that the structure gives. `None` when the bytes are no
/// such frame.
pub fn unpack(mut from: &[u8], past: &[&Moment], now: &mut Moment) -> Option<()> {
    for (pair, numbers) in now.numbers.chunks_mut(2).enumerate() {
        let head = take(&mut from)?;
        for (half, number) in numbers.iter_mut().enumerate() {
            let expected = expect(past.iter().map(|moment| moment.numbers[2 * pair + half]), 0.0);
            *number = take_distance(head >> (4 * half) & 0xf, expected, &mut from)?;
        }
    }
    match past.first() {
        Some(moment) => now.counts.copy_from_slice(&moment.counts),
        None => now.counts.fill(0),
    }
    let mut at = 0_usize;
    for _ in 0..take_count(&mut from)? {
        at = at.checked_add(usize::try_from(take_count(&mut from)?).ok()?)?;
        let count = now.counts.get_mut(at)?;
        *count = u32::try_from(i64::from(*count).checked_add(unzigzag(take_count(&mut from)?))?).ok()?;
        at += 1;
    }
    for (list, bonds) in now.bonds.iter_mut().enumerate() {
        bonds.clear();
        let mut first = 0_u32;
        for _ in 0..take_count(&mut from)? {
            first = first.checked_add(u32::try_from(take_count(&mut from)?).ok()?)?;
            let pair = [first, first.checked_add(u32::try_from(take_count(&mut from)?).ok()?)?];
            let head = take(&mut from)?;
            let holds = head >> 4 != 0;
            let progress = take_distance(head & 0xf, expect_bond(pair, holds, list, past), &mut from)?;
            bonds.push(Bond { pair, progress, holds });
        }
    }
    from.is_empty().then_some(())
}

/// What a value goes on to from its last two, the latest first.
fn expect(mut past: impl Iterator<Item = f64>, otherwise: f64) -> f64 {
    match (past.next(), past.next()) {
        (None, _) => otherwise,
        (Some(last), None) => last,
        (Some(last), Some(before)) => 2.0 * last - before,
    }
}

fn expect_bond(pair: [u32; 2], holds: bool, list: usize, past: &[&Moment]) -> f64 {
    let progress = |moment: &&Moment| {
        let bonds = moment.bonds.get(list)?;
        bonds.binary_search_by_key(&pair, |bond| bond.pair).ok().map(|at| bonds[at].progress)
    };
    expect(past.iter().map_while(progress), if holds { 0.0 } else { 1.0 })
}

/// The place of a double in the row of all, so that neighbours are one apart; it is its own inverse.
fn place(bits: i64) -> i64 {
    bits ^ ((bits >> 63) as u64 >> 1) as i64
}

fn zigzag(x: i64) -> u64 {
    ((x << 1) ^ (x >> 63)) as u64
}

fn unzigzag(x: u64) -> i64 {
    (x >> 1) as i64 ^ -((x & 1) as i64)
}

/// Appends how far a number is from what was expected; gives the bytes it took.
fn put_distance(number: f64, expected: f64, out: &mut Vec<u8>) -> u8 {
    let [number, expected] = [number, expected].map(|x| place(x.to_bits() as i64));
    let distance = zigzag(number.wrapping_sub(expected));
    let length = 8 - distance.leading_zeros() / 8;
    out.extend_from_slice(&distance.to_le_bytes()[..length as usize]);
    length as u8
}

fn take_distance(length: u8, expected: f64, from: &mut &[u8]) -> Option<f64> {
    let (taken, rest) = from.split_at_checked(length.into())?;
    let mut bytes = [0; 8];
    bytes.get_mut(..taken.len())?.copy_from_slice(taken);
    *from = rest;
    let distance = unzigzag(u64::from_le_bytes(bytes));
    Some(f64::from_bits(place(place(expected.to_bits() as i64).wrapping_add(distance)) as u64))
}

/// Appends a count, seven bits a byte.
fn put_count(mut count: u64, out: &mut Vec<u8>) {
    while count >= 0x80 {
        out.push(count as u8 | 0x80);
        count >>= 7;
    }
    out.push(count as u8);
}

fn take_count(from: &mut &[u8]) -> Option<u64> {
    let mut count = 0_u64;
    for shift in (0..64).step_by(7) {
        let byte = take(from)?;
        count |= u64::from(byte & 0x7f).checked_shl(shift)?;
        if byte < 0x80 {
            return Some(count);
        }
    }
    None
}

fn take(from: &mut &[u8]) -> Option<u8> {
    let (first, rest) = from.split_first()?;
    *from = rest;
    Some(*first)
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn moments(numbers: usize, counts: usize) -> impl Strategy<Value = Moment> {
        let bond = (0..40_u32, 1..40_u32, any::<f64>(), any::<bool>());
        let bonds = prop::collection::vec(bond, 0..20).prop_map(|list| {
            let bond = |(first, way, progress, holds)| Bond { pair: [first, first + way], progress, holds };
            let mut list: Vec<Bond> = list.into_iter().map(bond).collect();
            list.sort_by_key(|bond| bond.pair);
            list.dedup_by_key(|bond| bond.pair);
            vec![list]
        });
        let numbers = prop::collection::vec(any::<u64>().prop_map(f64::from_bits), numbers);
        let counts = prop::collection::vec(prop_oneof![Just(0), Just(7), any::<u32>()], counts);
        (numbers, counts, bonds).prop_map(|(numbers, counts, bonds)| Moment { numbers, counts, bonds })
    }

    fn bits(moment: &Moment) -> String {
        let numbers: Vec<u64> = moment.numbers.iter().map(|x| x.to_bits()).collect();
        let bonds: Vec<_> = moment.bonds[0].iter().map(|b| (b.pair, b.progress.to_bits(), b.holds)).collect();
        format!("{numbers:?} {:?} {bonds:?}", moment.counts)
    }

    proptest! {
        #[test]
        fn every_bit_comes_back(now in moments(7, 6), last in moments(7, 6), before in moments(7, 6), known in 0..3_usize) {
            let past = &[&last, &before][..known];
            let mut bytes = Vec::new();
            pack(&now, past, &mut bytes);
            let mut found = Moment { numbers: vec![0.0; 7], counts: vec![0; 6], bonds: vec![Vec::new()] };
            prop_assert!(unpack(&bytes, past, &mut found).is_some());
            prop_assert_eq!(bits(&found), bits(&now));
            // Nothing is read beyond the end, and nothing is left over.
            bytes.push(0);
            prop_assert!(unpack(&bytes, past, &mut found).is_none());
            for end in 0..bytes.len() - 1 {
                prop_assert!(unpack(&bytes[..end], past, &mut found).is_none());
            }
        }

        #[test]
        fn any_bytes_are_read_without_a_panic(bytes in prop::collection::vec(any::<u8>(), 0..200), last in moments(7, 6)) {
            let mut found = Moment { numbers: vec![0.0; 7], counts: vec![0; 6], bonds: vec![Vec::new()] };
            let _ = unpack(&bytes, &[&last], &mut found);
        }
    }

    #[test]
    fn what_goes_on_as_before_takes_half_a_byte() {
        let at = |time: f64| Moment { numbers: vec![0.25, 1.0 - 0.125 * time, -0.0, 0.0], ..Moment::default() };
        let mut bytes = Vec::new();
        pack(&at(2.0), &[&at(1.0), &at(0.0)], &mut bytes);
        // Two bytes for four numbers, one for a zero with a sign, one for no change of labels.
        assert_eq!(bytes.len(), 4);
    }
}
