//! [`in_figure`]: panes as columns of figures.

use super::super::keys::ImprintSource;
use super::super::pane::{Kind, Pane};
use super::super::state::State;
use super::super::state::settings::GelView;
use super::super::state::settings::versus::VersusMode;
use touch2touch_pipeline::images::figure::FigurePane;

/// The column of a figure that shows the same as a pane; `None` of panes that are no pictures.
pub(crate) fn in_figure(state: &State, pane: Pane) -> Option<FigurePane> {
    let settings = &state.settings;
    Some(match pane.kind() {
        Kind::Color => match settings.gel {
            GelView::Difference => FigurePane::GelSlim,
            GelView::Raw => FigurePane::Raw,
            GelView::Reference => FigurePane::Reference,
        },
        Kind::Imprint(ImprintSource::Measured) => FigurePane::Measured,
        Kind::Imprint(ImprintSource::Predicted) => FigurePane::Predicted,
        Kind::Versus if settings.compared().is_error() => FigurePane::Error,
        Kind::Versus if settings.compared().mode == VersusMode::Difference => FigurePane::Compare,
        _ => return None,
    })
}
