//! The application model: state, commands, jobs. No window.
