//! [`Tensor`]: an array that may be followed back to the weights it depends on; [`Tape`]: the record of how it was made.
//!
//! An operator computes its result at once and leaves on the tape what its backward pass needs. [`backward`] then runs
//! the tape from its end; each entry frees what it held as soon as it is done. A tape belongs to one thread.

use std::cell::RefCell;
use std::rc::Rc;
use std::sync::Arc;

/// An array of f32 in row-major order. Copies share their values.
#[derive(Clone, Debug)]
pub struct Tensor {
    shape: Vec<usize>,
    values: Arc<Vec<f32>>,
    node: Option<Node>,
}

/// A place on a tape.
#[derive(Clone)]
struct Node {
    tape: Rc<Tape>,
    place: usize,
}

/// Tape: the backward steps of what was computed, in order.
#[derive(Default)]
pub(crate) struct Tape {
    steps: RefCell<Vec<Option<Backward>>>,
}

/// Takes the loss's slope along an operator's result to those along its inputs.
type Backward = Box<dyn FnOnce(Vec<f32>, &mut Slopes)>;

impl std::fmt::Debug for Node {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "node {}", self.place)
    }
}

impl Tape {
    fn push(&self, step: Option<Backward>) -> usize {
        let mut steps = self.steps.borrow_mut();
        steps.push(step);
        steps.len() - 1
    }
}

impl Tensor {
    /// An array that is not followed.
    pub fn new(shape: &[usize], values: impl Into<Arc<Vec<f32>>>) -> Self {
        let values = values.into();
        assert_eq!(shape.iter().product::<usize>(), values.len(), "one value per place of {shape:?}");
        Self { shape: shape.to_vec(), values, node: None }
    }

    /// Array as a leaf of a tape: its slope is kept.
    #[must_use]
    pub(crate) fn tracked(mut self, tape: &Rc<Tape>) -> Self {
        self.node = Some(Node { tape: tape.clone(), place: tape.push(None) });
        self
    }

    /// The result of an operator on `inputs`. `backward` is kept if any of them is followed; it must not hold tensors
    /// (they hold the tape), only their values.
    pub(crate) fn made<const N: usize>(
        inputs: [&Tensor; N],
        shape: &[usize],
        values: Vec<f32>,
        backward: impl FnOnce(Vec<f32>, [Slot; N], &mut Slopes) + 'static,
    ) -> Self {
        let mut tensor = Self::new(shape, values);
        if let Some(tape) = inputs.iter().find_map(|input| input.node.as_ref()).map(|node| node.tape.clone()) {
            let slots = inputs.map(|input| Slot(input.node.as_ref().map(|node| node.place)));
            let step: Backward = Box::new(move |slope, slopes| backward(slope, slots, slopes));
            let place = tape.push(Some(step));
            tensor.node = Some(Node { tape, place });
        }
        tensor
    }

    /// Values in another shape.
    #[must_use]
    pub(crate) fn reshaped(mut self, shape: &[usize]) -> Self {
        assert_eq!(shape.iter().product::<usize>(), self.values.len(), "{:?} as {shape:?}", self.shape);
        self.shape = shape.to_vec();
        self
    }

    /// Values, no longer followed.
    #[must_use]
    pub(crate) fn detached(mut self) -> Self {
        self.node = None;
        self
    }

    /// Shape, slowest axis first.
    pub fn shape(&self) -> &[usize] {
        &self.shape
    }

    /// Shape as so many numbers.
    ///
    /// # Panics
    /// If it has another number of axes.
    pub fn dims<const D: usize>(&self) -> [usize; D] {
        self.shape.as_slice().try_into().unwrap_or_else(|_| panic!("{D} axes of {:?}", self.shape))
    }

    /// Values, as many as the shape has places.
    pub fn values(&self) -> &[f32] {
        &self.values
    }

    /// Values, shared.
    pub(crate) fn shared(&self) -> Arc<Vec<f32>> {
        self.values.clone()
    }
}

/// Place of the slope along an input; none, if the input is not followed.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Slot(Option<usize>);

/// The loss's slopes along what is on a tape.
#[derive(Debug)]
pub struct Slopes {
    by_place: Vec<Option<Vec<f32>>>,
}

impl Slopes {
    /// Adds to an input's slope; what is not wanted is not computed.
    pub(crate) fn add(&mut self, slot: Slot, slope: impl FnOnce() -> Vec<f32>) {
        let Some(place) = slot.0 else { return };
        let slope = slope();
        match &mut self.by_place[place] {
            Some(sum) => sum.iter_mut().zip(slope).for_each(|(sum, part)| *sum += part),
            empty => *empty = Some(slope),
        }
    }

    /// True where the slope along an input is wanted.
    pub(crate) fn wants(&self, slot: Slot) -> bool {
        slot.0.is_some()
    }

    /// The slope along a leaf; `None` if it took no part.
    pub fn take(&mut self, leaf: &Tensor) -> Option<Vec<f32>> {
        leaf.node.as_ref().and_then(|node| self.by_place[node.place].take())
    }
}

/// The slopes of a single number along all leaves of its tape, which is used up.
pub fn backward(loss: &Tensor) -> Slopes {
    assert_eq!(loss.values.len(), 1, "slopes are those of one number");
    let Some(Node { tape, place }) = &loss.node else { return Slopes { by_place: Vec::new() } };
    let mut steps = std::mem::take(&mut *tape.steps.borrow_mut());
    let mut slopes = Slopes { by_place: vec![None; steps.len()] };
    slopes.by_place[*place] = Some(vec![1.0]);
    while let Some(step) = steps.pop() {
        // Leaves have no step: their slopes stay.
        if let Some(step) = step
            && let Some(slope) = slopes.by_place[steps.len()].take()
        {
            step(slope, &mut slopes);
        }
    }
    slopes
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::ops::{blend, mul};

    #[test]
    fn slopes_add_up_over_all_uses() {
        let tape = Rc::new(Tape::default());
        let x = Tensor::new(&[1], vec![3.0]).tracked(&tape);
        let y = Tensor::new(&[1], vec![5.0]).tracked(&tape);
        let unused = Tensor::new(&[1], vec![0.0]).tracked(&tape);
        // x² y + 2 x
        let loss = blend(&mul(&mul(&x, &x), &y), 1.0, &x, 2.0);
        assert_eq!(loss.values(), [51.0]);
        let mut slopes = backward(&loss);
        assert_eq!(slopes.take(&x), Some(vec![32.0]));
        assert_eq!(slopes.take(&y), Some(vec![9.0]));
        assert_eq!(slopes.take(&unused), None);
    }

    #[test]
    fn nothing_is_kept_of_what_is_not_followed() {
        let x = Tensor::new(&[2], vec![3.0, 4.0]);
        assert!(mul(&x, &x).node.is_none());
        let tape = Rc::new(Tape::default());
        let leaf = x.clone().tracked(&tape);
        let product = mul(&leaf, &x);
        assert!(product.node.is_some() && product.detached().node.is_none());
        assert_eq!(Rc::strong_count(&tape), 2);
        assert_eq!(Arc::strong_count(&leaf.values), 4);
        drop(leaf);
        assert_eq!(Rc::strong_count(&tape), 1);
    }
}
