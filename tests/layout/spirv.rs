//! Reads the few SPIR-V instructions that carry names, offsets, bindings and
//! uses of variables. [SPIR-V 1.5, §3.37]

use std::collections::BTreeMap;
use std::path::PathBuf;

const MAGIC: u32 = 0x0723_0203;
const HEADER_WORDS: usize = 5;

const OP_NAME: u32 = 5;
const OP_MEMBER_NAME: u32 = 6;
const OP_EXT_INST: u32 = 12;
const OP_TYPE_RUNTIME_ARRAY: u32 = 29;
const OP_FUNCTION: u32 = 54;
const OP_LOAD: u32 = 61;
const OP_ACCESS_CHAIN: u32 = 65;
const OP_DECORATE: u32 = 71;
const OP_MEMBER_DECORATE: u32 = 72;
const OP_LABEL: u32 = 248;

const SPEC_ID: u32 = 1;
const ARRAY_STRIDE: u32 = 6;
const BINDING: u32 = 33;
const OFFSET: u32 = 35;

/// A compiled shader: instructions as (opcode, operands).
pub struct Module(Vec<(u32, Vec<u32>)>);

/// A struct as the compiler laid it out.
pub struct Structure {
    /// Name and offset of each member, in order.
    pub fields: Vec<(String, usize)>,
    /// Distance of two elements of an array of it.
    pub stride: usize,
}

/// Where the build script writes the modules.
pub fn path(name: &str) -> PathBuf {
    PathBuf::from(env!("ETENDUE_SHADER_DIR")).join(format!("{name}.spv"))
}

impl Module {
    /// The module that the build script made under this name.
    pub fn read(name: &str) -> Self {
        Self::parse(&std::fs::read(path(name)).unwrap())
    }

    /// A module from its bytes.
    pub fn parse(bytes: &[u8]) -> Self {
        let words: Vec<u32> = bytes
            .chunks_exact(4)
            .map(|w| u32::from_le_bytes(w.try_into().unwrap()))
            .collect();
        assert_eq!(words[0], MAGIC);
        let mut instructions = Vec::new();
        let mut rest = &words[HEADER_WORDS..];
        while let Some(first) = rest.first() {
            let (instruction, after) = rest.split_at((first >> 16) as usize);
            instructions.push((first & 0xFFFF, instruction[1..].to_vec()));
            rest = after;
        }
        Self(instructions)
    }

    /// Operands of every instruction of one kind.
    fn all(&self, opcode: u32) -> impl Iterator<Item = &[u32]> {
        self.0
            .iter()
            .filter(move |(op, _)| *op == opcode)
            .map(|(_, operands)| operands.as_slice())
    }

    /// Target and value of a decoration that has one value.
    fn decorations(&self, decoration: u32) -> impl Iterator<Item = (u32, u32)> {
        self.all(OP_DECORATE)
            .filter(move |o| o[1] == decoration)
            .map(|o| (o[0], o[2]))
    }

    fn name(&self, id: u32) -> String {
        let named = self.all(OP_NAME).find(|o| o[0] == id);
        text(&named.unwrap_or_else(|| panic!("%{id} has no name"))[1..])
    }

    /// The struct of this name, as it lies in an array.
    pub fn structure(&self, name: &str) -> Structure {
        let id = self
            .all(OP_NAME)
            .find(|o| text(&o[1..]) == name)
            .unwrap_or_else(|| panic!("the probe does not bind {name}"))[0];
        let offsets: BTreeMap<u32, usize> = self
            .all(OP_MEMBER_DECORATE)
            .filter(|o| o[0] == id && o[2] == OFFSET)
            .map(|o| (o[1], o[3] as usize))
            .collect();
        let fields = self
            .all(OP_MEMBER_NAME)
            .filter(|o| o[0] == id)
            .map(|o| (text(&o[2..]), offsets[&o[1]]))
            .collect();
        let array = self
            .all(OP_TYPE_RUNTIME_ARRAY)
            .find(|o| o[1] == id)
            .unwrap_or_else(|| panic!("the probe binds no array of {name}"))[0];
        let stride = self.decorations(ARRAY_STRIDE).find(|(t, _)| *t == array);
        Structure {
            fields,
            stride: stride.unwrap().1 as usize,
        }
    }

    /// Specialisation constants by id, with their names.
    pub fn spec_ids(&self) -> Vec<(u32, String)> {
        let mut ids: Vec<_> = self
            .decorations(SPEC_ID)
            .map(|(target, id)| (id, self.name(target)))
            .collect();
        ids.sort_unstable();
        ids
    }

    /// The ids alone, also of modules without names.
    pub fn spec_numbers(&self) -> Vec<u32> {
        let mut ids: Vec<_> = self.decorations(SPEC_ID).map(|(_, id)| id).collect();
        ids.sort_unstable();
        ids
    }

    /// Bindings whose variables are read or written, sorted.
    pub fn bindings_in_use(&self) -> Vec<u32> {
        let touched: Vec<u32> = [OP_LOAD, OP_ACCESS_CHAIN]
            .into_iter()
            .flat_map(|op| self.all(op).map(|o| o[2]))
            .collect();
        let mut bindings: Vec<u32> = self
            .decorations(BINDING)
            .filter(|(variable, _)| touched.contains(variable))
            .map(|(_, binding)| binding)
            .collect();
        bindings.sort_unstable();
        bindings
    }

    /// Uses of an instruction of GLSL.std.450, the only extended set there is.
    pub fn extended(&self, instruction: u32) -> usize {
        self.all(OP_EXT_INST)
            .filter(|o| o[3] == instruction)
            .count()
    }

    /// Basic blocks.
    pub fn blocks(&self) -> usize {
        self.0.iter().filter(|(op, _)| *op == OP_LABEL).count()
    }

    /// Instructions from the first function on.
    pub fn code_size(&self) -> usize {
        let before = self.0.iter().take_while(|(op, _)| *op != OP_FUNCTION);
        self.0.len() - before.count()
    }
}

/// A literal string: bytes up to a zero.
fn text(words: &[u32]) -> String {
    let bytes: Vec<u8> = words.iter().flat_map(|w| w.to_le_bytes()).collect();
    let end = bytes.iter().position(|b| *b == 0).unwrap();
    String::from_utf8(bytes[..end].to_vec()).unwrap()
}
