//! Resecta. 
fn main() {}
