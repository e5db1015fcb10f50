//! The application model: state, commands, jobs. No window.
//!
//! * [`state::State`] holds everything the studio shows; views get `&State`.
//! * [`command::Command`] is what can happen to it, by room; [`apply::apply`] is the only writer and is pure:
//!   work and files come out as [`effect::Effect`]s.
//! * A room is a feature ([`library`], [`follow`], [`view`], [`predict`], [`seeds`], [`labels`], [`inspect`],
//!   [`workbench`], [`evaluate`], [`export`], [`adapt`], [`train`], [`dial`], [`settings`], [`tasks`]): its file has its commands
//!   and what they do, `state.rs` in its folder what it keeps and how views find it.
//! * [`results`] is the table of what is computed: each kind with its recipe, its job and its look-up in one file.
//! * [`pane`] is the table of the panes: titles, places, which file of the window draws each and what it needs.
//! * [`state::State::demands`] lists what the visible panes need and do not have; [`runtime::Runtime`] computes that on
//!   its lanes (files, computing, models) and answers with commands.
//! * [`action::Action`] is the table of what a person can trigger, with its keys: menus, palette and shortcut sheet are made
//!   from it; [`act`] turns its rows into commands.
//! * [`services`] joins the model to files and models; the command line calls the same functions.

pub mod act;
pub mod action;
pub mod adapt;
pub mod answers;
pub mod apply;
pub mod command;
pub mod demand;
pub mod dial;
pub mod effect;
pub mod evaluate;
pub mod export;
pub mod follow;
pub mod history;
pub mod inspect;
pub mod jobs;
pub mod keys;
pub mod labels;
pub mod library;
pub mod pane;
pub mod predict;
pub mod results;
pub mod runtime;
pub mod seeds;
pub mod services;
pub mod settings;
pub mod state;
pub mod tasks;
pub mod train;
pub mod view;
pub mod workbench;
