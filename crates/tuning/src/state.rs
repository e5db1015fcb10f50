//! A trainer's state as bytes: a run that was stopped goes on from them as if it had not been.
//!
//! Random numbers depend on the step alone, so that weights, their running mean, the optimizer's moments and the number
//! of steps are all there is to keep. The bytes end in their own digest; a damaged file is refused.

use std::sync::Arc;

use sha2::{Digest, Sha256};

use crate::error::{Error, Result};
use crate::trainer::{Objective, Trainer};

const MAGIC: &[u8; 8] = b"t2t-tune";
const VERSION: u32 = 1;
const DIGEST: usize = 32;

/// Origin of a run, as a digest: a state only goes on where it came from.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Origin([u8; DIGEST]);

/// Collects what an [`Origin`] depends on.
#[derive(Clone, Debug, Default)]
pub(crate) struct OriginBuilder(Sha256);

impl OriginBuilder {
    /// Adds bytes.
    #[must_use]
    pub(crate) fn bytes(mut self, bytes: &[u8]) -> Self {
        self.0.update((bytes.len() as u64).to_le_bytes());
        self.0.update(bytes);
        self
    }

    /// Adds numbers.
    #[must_use]
    pub(crate) fn numbers(self, numbers: &[f32]) -> Self {
        let bytes: Vec<u8> = numbers.iter().flat_map(|number| number.to_le_bytes()).collect();
        self.bytes(&bytes)
    }

    /// Adds anything that tells all its values by [`std::fmt::Debug`].
    #[must_use]
    pub(crate) fn told(self, value: &impl std::fmt::Debug) -> Self {
        self.bytes(format!("{value:?}").as_bytes())
    }

    /// The digest.
    pub(crate) fn finish(self) -> Origin {
        Origin(self.0.finalize().into())
    }
}

impl<O: Objective> Trainer<O> {
    /// The state, to be kept where it survives the program.
    pub(crate) fn to_bytes(&self, origin: Origin) -> Vec<u8> {
        let mut bytes = MAGIC.to_vec();
        bytes.extend(VERSION.to_le_bytes());
        bytes.extend(origin.0);
        bytes.extend((self.step as u64).to_le_bytes());
        bytes.extend(self.optimizer.steps.to_le_bytes());
        for values in self.kept() {
            bytes.extend(values.iter().flat_map(|value| value.to_le_bytes()));
        }
        bytes.extend(Sha256::digest(&bytes));
        bytes
    }

    /// Takes over the state of a run with the same origin.
    ///
    /// # Errors
    /// [`Error::State`] if the bytes are damaged, of another version or another run; the trainer is then as before.
    pub(crate) fn restore(&mut self, origin: Origin, bytes: &[u8]) -> Result<()> {
        let count: usize = self.kept().iter().map(|values| values.len()).sum();
        let mut reader = Reader(bytes);
        if reader.take(MAGIC.len())? != MAGIC {
            return Err(Error::State("it is not a state of tuning"));
        }
        if u32::from_le_bytes(reader.array()?) != VERSION {
            return Err(Error::State("it is of another version of the program"));
        }
        if reader.array()? != origin.0 {
            return Err(Error::State("it belongs to another bundle, other pairs or other settings"));
        }
        let (body, digest) = bytes.split_at(bytes.len() - DIGEST);
        if Sha256::digest(body).as_slice() != digest {
            return Err(Error::State("it is damaged"));
        }
        let (step, steps) = (u64::from_le_bytes(reader.array()?), u32::from_le_bytes(reader.array()?));
        if reader.0.len() != 4 * count + DIGEST {
            return Err(Error::State("it is damaged"));
        }
        for values in self.kept_mut() {
            let bytes = reader.take(4 * values.len())?.chunks_exact(4);
            for (value, bytes) in values.iter_mut().zip(bytes) {
                *value = f32::from_le_bytes([bytes[0], bytes[1], bytes[2], bytes[3]]);
            }
        }
        self.step = usize::try_from(step).unwrap_or(usize::MAX);
        self.optimizer.steps = steps;
        Ok(())
    }

    fn kept(&self) -> Vec<&Vec<f32>> {
        let weights = self.params.entries().iter().chain(self.average.entries()).map(|entry| &*entry.values);
        let moments = self.optimizer.moments.iter().flatten().flat_map(|m| [&m.first, &m.second]);
        weights.chain(moments).collect()
    }

    fn kept_mut(&mut self) -> Vec<&mut Vec<f32>> {
        let weights = self.params.values_mut().chain(self.average.values_mut()).map(Arc::make_mut);
        let moments = self.optimizer.moments.iter_mut().flatten().flat_map(|m| [&mut m.first, &mut m.second]);
        weights.chain(moments).collect()
    }
}

/// Bytes that are taken from the front.
struct Reader<'a>(&'a [u8]);

impl<'a> Reader<'a> {
    fn take(&mut self, count: usize) -> Result<&'a [u8]> {
        let (head, tail) = self.0.split_at_checked(count).ok_or(Error::State("it ends too early"))?;
        self.0 = tail;
        Ok(head)
    }

    fn array<const N: usize>(&mut self) -> Result<[u8; N]> {
        self.take(N)?.try_into().map_err(|_| Error::State("it ends too early"))
    }
}
