//! Buffers, views and accessors. All arithmetic on sizes from the file is checked
//! here, once, when a [`Reader`] is made; elements are then decoded on demand,
//! so that nothing is allocated for what an accessor merely claims.

mod component;

pub(super) use self::component::Kinds;
use self::component::{Component, components};
use super::json::{self, Root, Shape};
use super::resolve::Files;
use super::{Check, get};

/// The contents of all buffers.
pub(super) struct Buffers<'a> {
    root: &'a Root,
    data: Vec<Vec<u8>>,
}

impl<'a> Buffers<'a> {
    /// Reads every buffer; `binary` is the chunk of a `.glb`.
    pub fn load(root: &'a Root, mut binary: Option<Vec<u8>>, files: &mut Files) -> Check<Self> {
        let mut data = Vec::new();
        for (i, buffer) in root.buffers.iter().enumerate() {
            let mut bytes = match (&buffer.uri, i) {
                (Some(uri), _) => files
                    .fetch(uri)
                    .map_err(|what| format!("buffers[{i}]: {what}"))?,
                (None, 0) if binary.is_some() => binary.take().unwrap_or_default(),
                (None, _) => {
                    return Err(format!(
                        "buffers[{i}]: data is missing: no uri and no binary chunk for it"
                    ));
                }
            };
            let length = buffer
                .byte_length
                .ok_or_else(|| format!("buffers[{i}]: byteLength is missing"))?;
            if length > bytes.len() as u64 {
                return Err(format!(
                    "buffers[{i}]: byteLength is {length}, but only {} bytes are there",
                    bytes.len()
                ));
            }
            bytes.truncate(length as usize);
            data.push(bytes);
        }
        Ok(Self { root, data })
    }

    /// The bytes of a buffer view and its stride, where it has one.
    pub fn view(&self, index: u32, user: &str) -> Check<(&[u8], Option<u64>)> {
        let view = get(&self.root.buffer_views, index, "bufferViews", user)?;
        let user = format!("bufferViews[{index}]");
        let buffer = view
            .buffer
            .ok_or_else(|| format!("{user}: buffer is missing"))?;
        let data = get(&self.data, buffer, "buffers", &user)?;
        let length = view
            .byte_length
            .ok_or_else(|| format!("{user}: byteLength is missing"))?;
        let bytes = slice(data, view.byte_offset, length).ok_or_else(|| {
            format!(
                "{user}: byteOffset {} + byteLength {length} reach past the {} bytes of buffers[{buffer}]",
                view.byte_offset,
                data.len()
            )
        })?;
        if view.byte_stride.is_some_and(|s| !(4..=252).contains(&s)) {
            return Err(format!("{user}: byteStride must be in 4 … 252"));
        }
        Ok((bytes, view.byte_stride))
    }

    /// A checked accessor. `use_name` says in messages what it is for.
    pub fn reader(
        &self,
        index: u32,
        use_name: &str,
        shapes: &[Shape],
        kinds: Kinds,
    ) -> Check<Reader<'_>> {
        let accessor = get(&self.root.accessors, index, "accessors", use_name)?;
        let user = format!("accessors[{index}] ({use_name})");
        let component = Component::from_code(accessor.component_type, &user)?;
        let shape = accessor
            .shape
            .ok_or_else(|| format!("{user}: type is missing"))?;
        if !shapes.contains(&shape) {
            return Err(format!(
                "{user}: type {shape:?} is not allowed here, only {shapes:?}"
            ));
        }
        if !kinds.allows(component, accessor.normalized) {
            return Err(format!(
                "{user}: componentType {component:?}{} is not allowed here",
                if accessor.normalized {
                    " (normalized)"
                } else {
                    ""
                }
            ));
        }
        let count = accessor.count.filter(|&count| count > 0);
        let count = count.ok_or_else(|| format!("{user}: count is missing or 0"))?;
        let size = components(shape) * component.size();
        let base = match accessor.buffer_view {
            Some(view) => {
                let (bytes, stride) = self.view(view, &user)?;
                let stride = stride.unwrap_or(size as u64);
                Some(Strided::new(
                    bytes,
                    accessor.byte_offset,
                    stride,
                    size,
                    count,
                    &user,
                )?)
            }
            None => None,
        };
        let sparse = match &accessor.sparse {
            Some(sparse) => Some(self.sparse(sparse, count, size, &user)?),
            None => None,
        };
        Ok(Reader {
            count,
            components: components(shape),
            component,
            normalized: accessor.normalized,
            base,
            sparse,
            user,
        })
    }

    fn sparse(
        &self,
        sparse: &json::Sparse,
        count: u64,
        size: usize,
        user: &str,
    ) -> Check<Sparse<'_>> {
        let changed = sparse.count.filter(|&n| n > 0 && n <= count);
        let changed =
            changed.ok_or_else(|| format!("{user}: sparse.count must be in 1 … {count}"))?;
        let part = |part: &json::SparsePart, size: usize, name: &str| {
            let user = format!("{user}: sparse.{name}");
            let view = part
                .buffer_view
                .ok_or_else(|| format!("{user}: bufferView is missing"))?;
            let (bytes, _) = self.view(view, &user)?;
            Strided::new(bytes, part.byte_offset, size as u64, size, changed, &user)
        };
        let kind = Component::from_code(sparse.indices.component_type, &format!("{user}: sparse"))?;
        if !Kinds::INDEX.allows(kind, false) {
            return Err(format!("{user}: sparse indices cannot be {kind:?}"));
        }
        let raw = part(&sparse.indices, kind.size(), "indices")?;
        let values = part(&sparse.values, size, "values")?;
        // `changed` is bounded by the bytes of the view now.
        let indices: Vec<u32> = (0..changed).map(|i| kind.index(raw.element(i))).collect();
        if indices.windows(2).any(|pair| pair[0] >= pair[1]) {
            return Err(format!("{user}: sparse indices do not increase strictly"));
        }
        if let Some(&last) = indices.last().filter(|&&last| u64::from(last) >= count) {
            return Err(format!(
                "{user}: sparse index {last} is out of range, count is {count}"
            ));
        }
        Ok(Sparse { indices, values })
    }
}

fn slice(data: &[u8], offset: u64, length: u64) -> Option<&[u8]> {
    let end = usize::try_from(offset.checked_add(length)?).ok()?;
    data.get(usize::try_from(offset).ok()?..end)
}

/// Equally spaced elements that have been found to lie within their view.
struct Strided<'a> {
    bytes: &'a [u8],
    stride: usize,
    size: usize,
}

impl<'a> Strided<'a> {
    fn new(
        bytes: &'a [u8],
        offset: u64,
        stride: u64,
        size: usize,
        count: u64,
        user: &str,
    ) -> Check<Self> {
        if stride < size as u64 {
            return Err(format!(
                "{user}: byteStride {stride} is less than the {size} bytes of an element"
            ));
        }
        let length = stride
            .checked_mul(count - 1)
            .and_then(|n| n.checked_add(size as u64));
        let bytes = length
            .and_then(|length| slice(bytes, offset, length))
            .ok_or_else(|| {
                format!(
                    "{user}: {count} elements of {size} bytes, {stride} apart from byteOffset {offset}, \
                     reach past the {} bytes of the bufferView",
                    bytes.len()
                )
            })?;
        Ok(Self {
            bytes,
            stride: stride as usize,
            size,
        })
    }

    fn element(&self, i: u64) -> &'a [u8] {
        let start = i as usize * self.stride;
        &self.bytes[start..start + self.size]
    }
}

struct Sparse<'a> {
    /// Strictly increasing.
    indices: Vec<u32>,
    values: Strided<'a>,
}

/// An accessor whose every element can be read.
pub(super) struct Reader<'a> {
    /// Number of elements.
    pub count: u64,
    /// Components of an element.
    pub components: usize,
    component: Component,
    normalized: bool,
    base: Option<Strided<'a>>,
    sparse: Option<Sparse<'a>>,
    user: String,
}

impl<'a> Reader<'a> {
    /// The element's bytes; `None` stands for zeros.
    fn element(&self, i: u64) -> Option<&'a [u8]> {
        let changed = self.sparse.as_ref().and_then(|sparse| {
            let i = u32::try_from(i).ok()?;
            let at = sparse.indices.binary_search(&i).ok()?;
            Some(sparse.values.element(at as u64))
        });
        changed.or_else(|| self.base.as_ref().map(|base| base.element(i)))
    }

    /// Up to four components of element `i < count`; missing ones are 0.
    pub fn floats(&self, i: u64) -> [f32; 4] {
        let mut floats = [0.0; 4];
        if let Some(bytes) = self.element(i) {
            let parts = bytes.chunks_exact(self.component.size());
            for (float, part) in floats.iter_mut().zip(parts) {
                *float = self.component.float(part, self.normalized);
            }
        }
        floats
    }

    /// As [`Self::floats`], but NaN and infinity are errors.
    pub fn finite(&self, i: u64) -> Check<[f32; 4]> {
        let floats = self.floats(i);
        if floats.iter().all(|x| x.is_finite()) {
            Ok(floats)
        } else {
            Err(format!("{}: element {i} is not finite", self.user))
        }
    }

    /// Scalar element `i < count` as an index.
    pub fn index(&self, i: u64) -> u32 {
        self.element(i)
            .map_or(0, |bytes| self.component.index(bytes))
    }

    /// What the accessor is, for messages.
    pub fn name(&self) -> &str {
        &self.user
    }
}
