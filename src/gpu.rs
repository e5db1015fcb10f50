//! The 3D renderer. Knows domain types, not the application state.
