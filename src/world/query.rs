//! Questions between steps: fields, contacts of a pair, rays, overlaps, closest points, seeds.
