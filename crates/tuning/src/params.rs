//! [`Params`]: named weights as plain vectors; [`Leaves`]: the same as tensors, for one run through a network.

use std::collections::BTreeMap;
use std::rc::Rc;
use std::sync::Arc;

use crate::tape::{Slopes, Tape, Tensor};

/// The weights of a network by name, in a fixed order. Copies share what neither changes.
#[derive(Clone, Debug, Default)]
pub struct Params {
    places: BTreeMap<String, usize>,
    entries: Vec<Entry>,
}

/// A named array.
#[derive(Clone, Debug)]
pub struct Entry {
    /// Name of the array.
    pub name: String,
    /// Shape, slowest axis first.
    pub shape: Vec<usize>,
    /// Values, as many as the shape has places.
    pub values: Arc<Vec<f32>>,
}

impl Params {
    /// Appends an array; a name can be used once.
    ///
    /// # Panics
    /// If the name is taken, or the number of values is not that of the shape.
    pub fn push(&mut self, name: impl Into<String>, shape: Vec<usize>, values: Vec<f32>) {
        let name = name.into();
        assert_eq!(shape.iter().product::<usize>(), values.len(), "{name}: one value per place");
        let before = self.places.insert(name.clone(), self.entries.len());
        assert!(before.is_none(), "{name}: named twice");
        self.entries.push(Entry { name, shape, values: Arc::new(values) });
    }

    /// The arrays in their order.
    pub fn entries(&self) -> &[Entry] {
        &self.entries
    }

    /// The array of a name.
    pub fn get(&self, name: &str) -> Option<&Entry> {
        self.places.get(name).map(|&place| &self.entries[place])
    }

    /// The values of all arrays, each to be changed if need be; a copy of an array is made only then.
    pub fn values_mut(&mut self) -> impl Iterator<Item = &mut Arc<Vec<f32>>> {
        self.entries.iter_mut().map(|entry| &mut entry.values)
    }

    /// The arrays as tensors; those that `trained` picks are leaves of a new tape.
    pub fn leaves(&self, trained: impl Fn(&str) -> bool) -> Leaves<'_> {
        let tape = Rc::new(Tape::default());
        let tensor = |entry: &Entry| {
            let tensor = Tensor::new(&entry.shape, entry.values.clone());
            if trained(&entry.name) { tensor.tracked(&tape) } else { tensor }
        };
        Leaves { params: self, tensors: self.entries.iter().map(tensor).collect() }
    }
}

/// Weights as tensors.
#[derive(Clone, Debug)]
pub struct Leaves<'a> {
    params: &'a Params,
    tensors: Vec<Tensor>,
}

impl Leaves<'_> {
    /// A weight.
    ///
    /// # Panics
    /// If there is none of this name: the layout of the file was not checked.
    pub fn get(&self, name: &str) -> Tensor {
        let place = self.params.places.get(name);
        self.tensors[*place.unwrap_or_else(|| panic!("no weight is called \"{name}\""))].clone()
    }

    /// True where there is a weight of this name.
    pub fn has(&self, name: &str) -> bool {
        self.params.places.contains_key(name)
    }

    /// The slopes in the order of the arrays; `None` for what is not trained or took no part.
    pub fn gradient(&self, mut slopes: Slopes) -> Vec<Option<Vec<f32>>> {
        self.tensors.iter().map(|tensor| slopes.take(tensor)).collect()
    }
}
