//! The arrangement of panes survives a restart, and a damaged one is replaced.
