//! Contents of a pickled dict of tensors: [`contents`].
//!
//! A pickle is a program for a stack machine; this one makes values of its own and runs nothing. What a byte of a program
//! can make is shared and never copied, the number of values is bounded, and nothing nests deeper than a tensor needs.

use std::cell::RefCell;
use std::collections::{BTreeMap, HashMap};
use std::rc::Rc;

use super::DType;

/// Most values that a pickle may make. A dict of the twelve tensors of a touch makes some hundred.
const MOST_VALUES: usize = 1 << 18;
/// The arguments that make a tensor are a tuple of tuples.
const DEEPEST: usize = 3;

/// Place of a tensor's values in a storage, in values.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Place {
    pub(super) storage: String,
    pub(super) dtype: DType,
    pub(super) offset: usize,
    pub(super) shape: Vec<usize>,
    pub(super) strides: Vec<usize>,
}

/// A value of the dict.
#[derive(Clone, Debug, PartialEq)]
pub(super) enum Item {
    Tensor(Place),
    Float(f64),
    Int(i64),
    Bool(bool),
    /// Whatever else, in words.
    Other(String),
}

/// Why a pickle is not read.
#[derive(Debug, PartialEq)]
pub(super) enum Refusal {
    /// It is no dict, or none that `torch.save` writes.
    NoDict,
    /// It makes too many values.
    TooLarge(String),
}

/// Keys and values of a dict.
type Items = Vec<(Rc<str>, Value)>;

/// Part of a pickle.
#[derive(Clone, Debug)]
enum Value {
    Text(Rc<str>),
    Int(i64),
    Float(f64),
    Bool(bool),
    /// Depth, and parts, none of which is a dict.
    Tuple(usize, Rc<[Value]>),
    /// Texts to values, none of which is a dict.
    Dict(Rc<RefCell<Items>>),
    /// A class or function, by its name.
    Name(Rc<str>),
    Tensor(Rc<Place>),
    /// Whatever else, in words; its parts do not matter.
    Other(Rc<str>),
    Mark,
}

/// The values of a pickled dict by key; keys that are no texts are left out.
pub(super) fn contents(pickle: &[u8]) -> Result<BTreeMap<String, Item>, Refusal> {
    let mut machine = Machine { rest: pickle, stack: Vec::new(), memo: HashMap::new(), made: 0 };
    while machine.step().ok_or(Refusal::NoDict)? {
        if machine.made > MOST_VALUES {
            return Err(Refusal::TooLarge(format!("its list of contents would take more than {MOST_VALUES} values")));
        }
    }
    let Some(Value::Dict(items)) = machine.stack.pop() else { return Err(Refusal::NoDict) };
    let item = |value: &Value| match value {
        Value::Tensor(place) => Item::Tensor(Place::clone(place)),
        Value::Float(x) => Item::Float(*x),
        Value::Int(x) => Item::Int(*x),
        Value::Bool(x) => Item::Bool(*x),
        Value::Text(_) => Item::Other("a text".into()),
        Value::Tuple(..) => Item::Other("a tuple".into()),
        Value::Name(name) => Item::Other(format!("{name} itself")),
        Value::Other(what) => Item::Other(what.to_string()),
        Value::Dict(_) | Value::Mark => Item::Other("a dict".into()),
    };
    let items = items.borrow();
    Ok(items.iter().map(|(key, value)| (key.to_string(), item(value))).collect())
}

struct Machine<'a> {
    rest: &'a [u8],
    stack: Vec<Value>,
    memo: HashMap<u64, Value>,
    /// Values made so far, those that are kept for later counted again.
    made: usize,
}

impl Machine<'_> {
    fn take(&mut self, count: u64) -> Option<&[u8]> {
        let (head, tail) = self.rest.split_at_checked(usize::try_from(count).ok()?)?;
        self.rest = tail;
        Some(head)
    }

    /// A little-endian number without sign.
    fn number(&mut self, bytes: u64) -> Option<u64> {
        Some(self.take(bytes)?.iter().rev().fold(0, |value, byte| value << 8 | u64::from(*byte)))
    }

    fn int(&mut self, bytes: u64) -> Option<Value> {
        self.number(bytes).and_then(|number| i64::try_from(number).ok()).map(Value::Int)
    }

    fn line(&mut self) -> Option<String> {
        let end = self.rest.iter().position(|byte| *byte == b'\n')?;
        let line = self.take(end as u64 + 1)?;
        Some(String::from_utf8_lossy(&line[..end]).into_owned())
    }

    fn text(&mut self, length_bytes: u64) -> Option<Value> {
        let length = self.number(length_bytes)?;
        Some(Value::Text(String::from_utf8_lossy(self.take(length)?).into()))
    }

    /// Values pushed since the last mark.
    fn marked(&mut self) -> Option<Vec<Value>> {
        let at = self.stack.iter().rposition(|value| matches!(value, Value::Mark))?;
        let items = self.stack.split_off(at + 1);
        self.stack.pop();
        Some(items)
    }

    fn last(&mut self, count: usize) -> Option<Vec<Value>> {
        let at = self.stack.len().checked_sub(count)?;
        Some(self.stack.split_off(at))
    }

    /// Puts keys and values into the dict on top; into something else they do not matter.
    fn put(&mut self, items: Vec<Value>) -> Option<bool> {
        if let Value::Dict(dict) = self.stack.last()? {
            let mut items = items.into_iter();
            while let (Some(key), Some(value)) = (items.next(), items.next()) {
                if let Value::Text(key) = key {
                    dict.borrow_mut().push((key, inner(value)));
                }
            }
        }
        Some(true)
    }

    /// One opcode, by the letters of Python's `pickletools`; `false` at the end.
    fn step(&mut self) -> Option<bool> {
        let op = self.take(1)?[0];
        let value = match op {
            b'.' => return Some(false),
            0x80 => return self.take(1).map(|_| true),
            0x95 => return self.take(8).map(|_| true),
            b'(' => Value::Mark,
            b'}' => Value::Dict(Rc::default()),
            b')' => tuple(Vec::new()),
            b'N' => Value::Other("None".into()),
            b']' => Value::Other("a list".into()),
            0x88 => Value::Bool(true),
            0x89 => Value::Bool(false),
            b'K' => self.int(1)?,
            b'M' => self.int(2)?,
            b'J' => Value::Int(i64::from(self.number(4)? as u32 as i32)),
            0x8a => {
                let length = self.number(1)?;
                let bytes = self.take(length)?;
                let sign = if bytes.last().is_some_and(|byte| byte & 0x80 != 0) { 0xff } else { 0 };
                let mut number = [sign; 8];
                number.get_mut(..bytes.len())?.copy_from_slice(bytes);
                Value::Int(i64::from_le_bytes(number))
            }
            b'G' => Value::Float(f64::from_be_bytes(self.take(8)?.try_into().ok()?)),
            b'X' => self.text(4)?,
            0x8c => self.text(1)?,
            b'U' | b'C' => self.text(1).map(|_| Value::Other("bytes".into()))?,
            b'T' | b'B' => self.text(4).map(|_| Value::Other("bytes".into()))?,
            b'c' => {
                let (module, name) = (self.line()?, self.line()?);
                Value::Name(format!("{module}.{name}").into())
            }
            0x93 => match &self.last(2)?[..] {
                [Value::Text(module), Value::Text(name)] => Value::Name(format!("{module}.{name}").into()),
                _ => return None,
            },
            b't' => tuple(self.marked()?),
            0x85 => tuple(self.last(1)?),
            0x86 => tuple(self.last(2)?),
            0x87 => tuple(self.last(3)?),
            // The storage stays the tuple that names it.
            b'Q' => return Some(true),
            b'R' | 0x81 => match &self.last(2)?[..] {
                [callable, arguments] => made_by(callable, arguments),
                _ => return None,
            },
            b'u' => {
                let items = self.marked()?;
                return self.put(items);
            }
            b's' => {
                let items = self.last(2)?;
                return self.put(items);
            }
            b'e' => return self.marked().map(|_| true),
            b'a' | b'b' => return self.stack.pop().map(|_| true),
            b'q' | b'r' | 0x94 => {
                let slot = match op {
                    b'q' => self.number(1)?,
                    b'r' => self.number(4)?,
                    _ => self.memo.len() as u64,
                };
                self.memo.insert(slot, self.stack.last()?.clone());
                self.made += 1;
                return Some(true);
            }
            b'h' | b'j' => {
                let slot = self.number(if op == b'h' { 1 } else { 4 })?;
                self.memo.get(&slot)?.clone()
            }
            _ => return None,
        };
        self.made += 1;
        self.stack.push(value);
        Some(true)
    }
}

/// A value as part of another one.
fn inner(value: Value) -> Value {
    if matches!(value, Value::Dict(_)) { Value::Other("a dict".into()) } else { value }
}

fn tuple(parts: Vec<Value>) -> Value {
    let depth = |part: &Value| if let Value::Tuple(depth, _) = part { *depth } else { 0 };
    match 1 + parts.iter().map(depth).max().unwrap_or(0) {
        depth if depth > DEEPEST => Value::Other("a tuple".into()),
        depth => Value::Tuple(depth, parts.into_iter().map(inner).collect()),
    }
}

/// Result of a class or function, called with its arguments.
fn made_by(callable: &Value, arguments: &Value) -> Value {
    let (Value::Name(name), Value::Tuple(_, arguments)) = (callable, arguments) else {
        return Value::Other("an object".into());
    };
    let made = match (&**name, &arguments[..]) {
        ("collections.OrderedDict", []) => Some(Value::Dict(Rc::default())),
        ("torch._utils._rebuild_tensor_v2", arguments) => place(arguments).map(|place| Value::Tensor(Rc::new(place))),
        ("torch._utils._rebuild_parameter", [tensor @ Value::Tensor(_), ..]) => Some(tensor.clone()),
        _ => None,
    };
    made.unwrap_or_else(|| Value::Other(format!("a value of {name}").into()))
}

/// The place that the arguments of `torch._utils._rebuild_tensor_v2` name: storage, offset, shape, strides.
fn place(arguments: &[Value]) -> Option<Place> {
    let [Value::Tuple(_, storage), Value::Int(offset), Value::Tuple(_, shape), Value::Tuple(_, strides), ..] =
        arguments
    else {
        return None;
    };
    let [_, Value::Name(class), Value::Text(key), ..] = &storage[..] else { return None };
    let dtype = match &**class {
        "torch.FloatStorage" => DType::F32,
        "torch.DoubleStorage" => DType::F64,
        "torch.HalfStorage" => DType::F16,
        "torch.BFloat16Storage" => DType::BF16,
        "torch.ByteStorage" | "torch.BoolStorage" => DType::U8,
        "torch.CharStorage" => DType::I8,
        "torch.ShortStorage" => DType::I16,
        "torch.IntStorage" => DType::I32,
        "torch.LongStorage" => DType::I64,
        _ => return None,
    };
    let number = |value: &Value| if let Value::Int(number) = value { usize::try_from(*number).ok() } else { None };
    let numbers = |values: &[Value]| values.iter().map(number).collect::<Option<Vec<usize>>>();
    let (shape, strides) = (numbers(shape)?, numbers(strides)?);
    let offset = usize::try_from(*offset).ok()?;
    (shape.len() == strides.len()).then(|| Place { storage: key.to_string(), dtype, offset, shape, strides })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_no_program_of_torch_is_refused_and_what_nests_for_ever_is_cut() {
        assert_eq!(contents(b"\x80\x02}."), Ok(BTreeMap::new()));
        for bytes in [&b""[..], b"N.", b"}h\x07.", b"t.", b"}(X\xff\xff\xff\xff"] {
            assert_eq!(contents(bytes), Err(Refusal::NoDict), "{bytes:?}");
        }
        let nested = [b"}X\x01\0\0\0a)".as_slice(), &b"\x85".repeat(200_000), b"s."].concat();
        assert_eq!(contents(&nested), Ok([("a".to_owned(), Item::Other("a tuple".into()))].into()));
        // A dict that holds itself.
        let own = contents(b"}q\0X\x01\0\0\0ah\0s.").unwrap();
        assert_eq!(own, [("a".to_owned(), Item::Other("a dict".into()))].into());
        for many in [b"}", b"(", b"\x94"] {
            let bomb = [b"}".as_slice(), &many.repeat(MOST_VALUES + 1)].concat();
            assert!(matches!(contents(&bomb), Err(Refusal::TooLarge(_))));
        }
    }

    #[test]
    fn numbers_have_their_signs() {
        let of = |value: &[u8]| contents(&[b"}X\x01\0\0\0a", value, b"s."].concat()).unwrap()["a"].clone();
        assert_eq!(of(b"J\xfe\xff\xff\xff"), Item::Int(-2));
        assert_eq!(of(b"M\xff\xff"), Item::Int(65_535));
        assert_eq!(of(b"\x8a\x01\xfb"), Item::Int(-5));
        assert_eq!(of(b"\x8a\x00"), Item::Int(0));
        assert_eq!(of(b"G\x3f\xd0\0\0\0\0\0\0"), Item::Float(0.25));
        assert_eq!(of(b"\x88"), Item::Bool(true));
        assert_eq!(of(b"]"), Item::Other("a list".into()));
    }
}
