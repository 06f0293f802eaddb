//! What is worth choosing among many things that cost time and have an error.

/// Places of those `(time, error)` that no other beats in one without being worse in the other, by growing time.
/// Errors that are not finite are never among them.
pub fn front(points: &[(f64, f64)]) -> Vec<usize> {
    let mut order: Vec<usize> = (0..points.len()).filter(|i| points[*i].1.is_finite()).collect();
    order.sort_by(|i, j| points[*i].0.total_cmp(&points[*j].0).then(points[*i].1.total_cmp(&points[*j].1)));
    let mut least = f64::INFINITY;
    order.retain(|i| {
        let better = points[*i].1 < least;
        least = least.min(points[*i].1);
        better
    });
    order
}

/// The place of the quickest of those whose error is at most `limit`.
pub fn quickest(points: &[(f64, f64)], limit: f64) -> Option<usize> {
    let good = (0..points.len()).filter(|i| points[*i].1 <= limit);
    good.min_by(|i, j| points[*i].0.total_cmp(&points[*j].0))
}
