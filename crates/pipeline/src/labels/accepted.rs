//! Accepted poses of the imprints of a pair, as files hold them.

use std::collections::BTreeMap;

use super::ImprintOf;
use crate::io::masks::ByImprint;
use crate::io::predicted_id::PredictedId;

/// Values by imprint, as files hold them.
pub(crate) fn by_imprint<T: Clone>(values: &BTreeMap<ImprintOf, T>) -> ByImprint<T> {
    let mut out = ByImprint::default();
    for (of, value) in values {
        match of {
            ImprintOf::Measured => out.accepted[0] = Some(value.clone()),
            ImprintOf::Predicted(id) if *id == PredictedId::unknown() => out.accepted[1] = Some(value.clone()),
            ImprintOf::Predicted(id) => drop(out.accepted_predicted.insert(id.clone(), value.clone())),
        }
    }
    out
}

/// Values that files hold, by imprint.
pub(crate) fn of_imprints<T>(stored: ByImprint<T>) -> BTreeMap<ImprintOf, T> {
    let unnamed = [ImprintOf::Measured, ImprintOf::unknown()].into_iter().zip(stored.accepted);
    let named = stored.accepted_predicted.into_iter().map(|(id, value)| (ImprintOf::Predicted(id), value));
    unnamed.filter_map(|(of, value)| Some((of, value?))).chain(named).collect()
}
