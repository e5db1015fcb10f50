//! The studio driven by clicks and keys, without a window: the whole job on simulated touches in a temporary folder.
//!
//! Everything is the program's own: files, labels, settings, simulator, models, registration.

mod label;
mod layout;
mod look;
mod rig;

mod calm;
mod chain;
mod compare;
mod daily;
mod doctor;
mod export;
mod follow;
mod frames;
mod generate;
mod inspect;
mod job;
mod jobs;
mod narrow;
mod palette;
mod queue;
mod results;
mod scene;
mod train;
mod unit;
mod unsaved;
mod workbench;
