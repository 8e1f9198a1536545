//! Resecta.
