//! Which tool is it? All tools of the data set, ranked for the touch on screen.

use std::sync::Arc;

use strum::IntoEnumIterator as _;

use super::super::jobs::{Job, Lane};
use super::super::keys::{ImprintSource, RankingKey, ToolKey};
use super::super::results;
use super::super::results::{Computes, Demands};
use super::super::services::SharedServices;
use super::super::state::{Lookup, State};
use touch2touch_core::which_tool::Candidate;
use touch2touch_pipeline::error::TaskError;
use touch2touch_pipeline::steps::tool::{NamedTool, named_tool};

impl Computes for RankingKey {
    fn job(&self, state: &State, _: &SharedServices) -> Option<Job<Vec<Candidate>>> {
        let open = state.library.open.as_ref()?;
        let (source, registered, registration) =
            (open.source.clone(), results::registered(state, &self.0)?, self.0.registration);
        let known = |name: String| {
            let key = ToolKey { dataset: open.seq, name: name.as_str().into() };
            (name, state.results.tools.get(&key).cloned())
        };
        let tools: Vec<(String, Option<Arc<NamedTool>>)> = open.index().tools().into_iter().map(known).collect();
        Some(Job::new(Lane::Compute, "Which tool", move |cx| {
            let mut models = Vec::with_capacity(tools.len());
            for (name, known) in tools {
                if cx.cancel.is_cancelled() {
                    return Err(TaskError::cancelled("Which tool"));
                }
                // A model that cannot be used is no candidate.
                let read = || Some(Arc::new(named_tool(&name, source.tool_mesh(&name).ok()?).ok()?));
                models.extend(known.or_else(read));
            }
            Ok(registered.which_tool(&models, registration))
        }))
    }

    fn wanted(wants: &mut Demands<'_>) {
        for source in ImprintSource::iter() {
            if let Some(key) = ranking_key(wants.state, source)
                && wants.state.results.poses.contains(&key.0)
            {
                wants.ask(key);
            }
        }
    }
}

/// The key of the ranking; `None` where nobody asked for one, or there is no pose.
fn ranking_key(state: &State, source: ImprintSource) -> Option<RankingKey> {
    let asked = state.workbench.tools_tried.filter(|asked| state.pair_key() == Some(*asked));
    asked.and_then(|_| Some(RankingKey(results::pose_key(state, source).ok()??)))
}

/// The tools of the data set, ranked for a side of the selected pair; `None` where nobody asked for it.
pub fn ranking(state: &State, source: ImprintSource) -> Option<Lookup<'_, Vec<Candidate>>> {
    let key = ranking_key(state, source)?;
    Some(state.look_or(Ok(Some(key)), || None).value())
}
