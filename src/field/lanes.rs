//! Bulk evaluation (filled in below).
