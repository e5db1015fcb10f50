//! The application model: state, commands, jobs. No window.
//!
//! * [`state::State`] holds everything the studio shows; views get `&State`.
//! * [`command::Command`] is what can happen to it; [`apply::apply`] is the only writer and is pure:
//!   work and files come out as [`effect::Effect`]s.
//! * [`state::State::wanted`] lists what the visible panes need and do not have; [`runtime::Runtime`] computes that on
//!   its lanes (files, computing, models) and answers with commands.
//! * [`action::Action`] is the table of what a person can trigger: menus, palette and shortcut sheet are made from it.
//! * [`services`] joins the model to files and models; the command line calls the same functions.

pub mod action;
pub mod apply;
pub mod command;
pub mod document;
pub mod effect;
pub mod evaluation;
pub mod figures;
mod generating;
pub mod history;
pub mod inspect;
pub mod jobs;
pub mod keys;
pub mod library;
pub mod pane;
pub mod results;
pub mod runtime;
pub mod seeds;
pub mod services;
pub mod settings;
pub mod state;
pub mod tasks;
pub mod wanted;
pub mod workbench;
