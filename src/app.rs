//! The application model: state, commands, jobs. No window.
//!
//! * [`state::State`] holds everything the studio shows, each room's part in a file of its own, with the results; views get
//!   `&State`. [`keys`] are the plain values that results are kept under.
//! * [`command::Command`] is what can happen to it, by room; [`apply::apply`] is the only writer and is pure:
//!   work and files come out as [`effect::Effect`]s.
//! * A room is a feature ([`library`], [`follow`], [`view`], [`predict`], [`labels`], [`inspect`],
//!   [`workbench`], [`evaluate`], [`export`], [`doctor`], [`learn`], [`settings`], [`tasks`]): its file has its commands
//!   and what they do.
//! * [`recipe`] is what the settings say, with the models that are there; [`results`] says how each result is computed and
//!   looked up.
//! * [`pane`] is the table of the panes: titles, places, which file of the window draws each and what it needs.
//! * [`demand::demands`] lists what the visible panes need and do not have; [`runtime::Runtime`] computes that on
//!   its workers (files, computing, models) and answers with commands.
//! * [`action::Action`] is the table of what a person can trigger, with its keys: menus, palette and shortcut sheet are made
//!   from it; [`act`] turns its rows into commands.
//! * [`source`] is an open data set with its labels, [`services`] are the folders and models of the program.

pub mod act;
pub mod action;
pub mod answers;
pub mod apply;
pub mod command;
pub mod demand;
pub mod doctor;
pub mod effect;
pub mod evaluate;
pub mod export;
pub mod follow;
pub mod inspect;
pub mod jobs;
pub mod keys;
pub mod labels;
pub mod learn;
pub mod library;
pub mod pane;
pub mod predict;
pub mod recipe;
pub mod results;
pub mod runtime;
pub mod scores;
pub mod services;
pub mod settings;
pub mod source;
pub mod state;
pub mod tasks;
pub mod view;
pub mod workbench;
