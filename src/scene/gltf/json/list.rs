//! JSON arrays that refuse to grow beyond a cap.

use std::fmt;
use std::marker::PhantomData;
use std::ops::Deref;

use serde::de::{Error, SeqAccess, Visitor};
use serde::{Deserialize, Deserializer};

/// Most entries of one JSON array of objects: bounds what 100 MB of `{},{},…`
/// turn into before any other limit can be checked.
pub(super) const MAX_ENTRIES: usize = 1 << 21;

/// The same for objects that are large in memory and few in real files.
pub(super) const MAX_LARGE: usize = 1 << 16;

/// A list that refuses to grow beyond `CAP` entries.
#[derive(Debug)]
pub(in crate::scene::gltf) struct List<T, const CAP: usize = MAX_ENTRIES>(Vec<T>);

impl<T, const CAP: usize> Default for List<T, CAP> {
    fn default() -> Self {
        Self(Vec::new())
    }
}

impl<T, const CAP: usize> Deref for List<T, CAP> {
    type Target = [T];
    fn deref(&self) -> &[T] {
        &self.0
    }
}

impl<'de, T: Deserialize<'de>, const CAP: usize> Deserialize<'de> for List<T, CAP> {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        struct Grow<T, const CAP: usize>(PhantomData<T>);
        impl<'de, T: Deserialize<'de>, const CAP: usize> Visitor<'de> for Grow<T, CAP> {
            type Value = List<T, CAP>;
            fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
                f.write_str("an array")
            }
            fn visit_seq<A: SeqAccess<'de>>(self, mut seq: A) -> Result<Self::Value, A::Error> {
                let mut list = Vec::new();
                while let Some(entry) = seq.next_element()? {
                    if list.len() == CAP {
                        return Err(A::Error::custom(format_args!(
                            "an array has more than {CAP} entries (the cap)"
                        )));
                    }
                    list.push(entry);
                }
                Ok(List(list))
            }
        }
        deserializer.deserialize_seq(Grow(PhantomData))
    }
}
