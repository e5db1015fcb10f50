//! The typeface of the window and of drawn figures, once in the program.

/// Roboto Regular, a TrueType file (see `assets/fonts/README.md`).
pub static REGULAR: &[u8] = include_bytes!("../../../../assets/fonts/Roboto-Regular.ttf");
