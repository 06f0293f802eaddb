//! Debug drawing: lines and points that show skeletons, seeds and contacts.
