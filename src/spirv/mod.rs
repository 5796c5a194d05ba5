//! SPIR-V modules without what their constants rule out. Drivers read a whole module before they know what is never taken, at
//! every start; so constants get their values here, and blocks that no path reaches are left out: conditional constant
//! propagation \[Wegman91\]. What is not known here stays as it is.
//!
//! \[Wegman91\] Wegman, Zadeck, Constant Propagation with Conditional Branches.

mod blocks;

use std::collections::{HashMap, HashSet};

use blocks::{Body, Function, Left};

/// Instructions, by the numbers of the specification (3.49).
mod op {
    pub const NAME: u32 = 5;
    pub const TYPE_BOOL: u32 = 20;
    pub const TYPE_INT: u32 = 21;
    pub const CONSTANT_TRUE: u32 = 41;
    pub const CONSTANT_FALSE: u32 = 42;
    pub const CONSTANT: u32 = 43;
    pub const CONSTANT_COMPOSITE: u32 = 44;
    pub const SPEC_CONSTANT_TRUE: u32 = 48;
    pub const SPEC_CONSTANT_FALSE: u32 = 49;
    pub const SPEC_CONSTANT: u32 = 50;
    pub const SPEC_CONSTANT_COMPOSITE: u32 = 51;
    pub const SPEC_CONSTANT_OP: u32 = 52;
    pub const FUNCTION: u32 = 54;
    pub const FUNCTION_END: u32 = 56;
    pub const DECORATE: u32 = 71;
    pub const I_ADD: u32 = 128;
    pub const LOGICAL_EQUAL: u32 = 164;
    pub const LOGICAL_NOT_EQUAL: u32 = 165;
    pub const LOGICAL_OR: u32 = 166;
    pub const LOGICAL_AND: u32 = 167;
    pub const LOGICAL_NOT: u32 = 168;
    pub const SELECT: u32 = 169;
    pub const I_EQUAL: u32 = 170;
    pub const I_NOT_EQUAL: u32 = 171;
    pub const U_GREATER_THAN: u32 = 172;
    pub const SHIFT_RIGHT_LOGICAL: u32 = 194;
    pub const SHIFT_LEFT_LOGICAL: u32 = 196;
    pub const BITWISE_OR: u32 = 197;
    pub const BITWISE_AND: u32 = 199;
    pub const PHI: u32 = 245;
    pub const LOOP_MERGE: u32 = 246;
    pub const SELECTION_MERGE: u32 = 247;
    pub const LABEL: u32 = 248;
    pub const BRANCH: u32 = 249;
    pub const BRANCH_CONDITIONAL: u32 = 250;
    pub const SWITCH: u32 = 251;
    pub const UNREACHABLE: u32 = 255;
}

/// Words before the first instruction, and which of them all numbers of results are below.
const HEADER_WORDS: usize = 5;
const BOUND: usize = 3;
/// The decoration that names a specialisation constant.
const SPEC_ID: u32 = 1;

/// An instruction with its operands.
type Words = [u32];

fn opcode(words: &Words) -> u32 {
    words[0] & 0xFFFF
}

fn instruction(opcode: u32, operands: &[u32]) -> Vec<u32> {
    let mut words = vec![(operands.len() as u32 + 1) << 16 | opcode];
    words.extend(operands);
    words
}

/// The module with these values (id and bits) for its specialisation constants, of those that it has; others keep their own.
/// Panics where it is no module, and where a constant has 64 bits.
#[must_use]
pub fn specialised(spirv: &[u32], constants: &[(u32, u32)]) -> Vec<u32> {
    module(spirv, constants).expect("modules are those of the build script")
}

fn module(spirv: &[u32], constants: &[(u32, u32)]) -> Option<Vec<u32>> {
    let all = split(spirv.get(HEADER_WORDS..)?)?;
    let first = all.iter().position(|words| opcode(words) == op::FUNCTION);
    let (head, mut rest) = all.split_at(first.unwrap_or(all.len()));
    // all results have smaller numbers
    let bound = *spirv.get(BOUND)? as usize;
    let mut known = Known {
        values: vec![Value::Varies; bound],
        ..Known::default()
    };
    let head = known.fix(head, constants)?;
    let mut body = Body::new(bound);
    while !rest.is_empty() {
        let is_end = |words: &&Words| opcode(words) == op::FUNCTION_END;
        let end = rest.iter().position(is_end)? + 1;
        let function = Function::new(&rest[..end], bound)?;
        let reach = function.reach(&mut known);
        function.emit(&reach, &mut body);
        rest = &rest[end..];
    }
    // decorations and names of what is gone go as well
    let is_about = |words: &Words| [op::DECORATE, op::NAME].contains(&opcode(words));
    let declared = head.iter().filter(|words| !is_about(words));
    for id in declared.flat_map(|words| words.iter().skip(1).take(2)) {
        body.note(*id, Left::Kept);
    }
    let mut module = Vec::with_capacity(spirv.len());
    module.extend_from_slice(&spirv[..HEADER_WORDS]);
    for words in &head {
        if !(is_about(words) && body.left[words[1] as usize] == Left::Gone) {
            module.extend_from_slice(words);
        }
    }
    module.extend(body.words);
    Some(module)
}

/// Instructions of a module after its header.
fn split(mut words: &[u32]) -> Option<Vec<&Words>> {
    let mut all = Vec::new();
    while let Some(&first) = words.first() {
        let count = (first >> 16) as usize;
        if count == 0 || count > words.len() {
            return None;
        }
        let (one, others) = words.split_at(count);
        all.push(one);
        words = others;
    }
    Some(all)
}

/// What is known of a result: a boolean, as 0 or 1, or a word of 32 bits.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Value {
    /// Nothing was computed yet.
    Open,
    Is(u32),
    Varies,
}

impl Value {
    fn with(self, other: Self, function: impl Fn(u32, u32) -> u32) -> Self {
        match (self, other) {
            (Self::Is(a), Self::Is(b)) => Self::Is(function(a, b)),
            (Self::Varies, _) | (_, Self::Varies) => Self::Varies,
            _ => Self::Open,
        }
    }

    /// Conjunction of booleans, where 0 is decisive, or disjunction, where 1 is.
    fn unless(self, other: Self, decisive: u32) -> Self {
        match (self, other) {
            (Self::Is(value), _) | (_, Self::Is(value)) if value == decisive => Self::Is(value),
            (Self::Is(_), other) | (other, Self::Is(_)) => other,
            (Self::Open, _) | (_, Self::Open) => Self::Open,
            (Self::Varies, Self::Varies) => Self::Varies,
        }
    }
}

/// What is known of a module's results.
#[derive(Default)]
struct Known {
    /// By their numbers.
    values: Vec<Value>,
    bools: HashSet<u32>,
    words: HashSet<u32>,
}

impl Known {
    /// The declarations of a module with values for its constants.
    fn fix(&mut self, head: &[&Words], constants: &[(u32, u32)]) -> Option<Vec<Vec<u32>>> {
        let mut given = HashMap::new();
        for words in head {
            if let [_, id, SPEC_ID, name] = **words {
                if opcode(words) == op::DECORATE {
                    let value = constants.iter().find(|(at, _)| *at == name);
                    given.extend(value.map(|&(_, value)| (id, value)));
                }
            }
        }
        let mut fixed = Vec::new();
        for &words in head {
            match (opcode(words), words) {
                (op::DECORATE, [_, _, SPEC_ID, _]) => continue,
                (op::TYPE_BOOL, [_, id]) => drop(self.bools.insert(*id)),
                (op::TYPE_INT, [_, id, 32, _]) => drop(self.words.insert(*id)),
                (op::CONSTANT_TRUE | op::SPEC_CONSTANT_TRUE, &[_, ty, id]) => {
                    fixed.push(self.constant(ty, id, *given.get(&id).unwrap_or(&1)));
                    continue;
                }
                (op::CONSTANT_FALSE | op::SPEC_CONSTANT_FALSE, &[_, ty, id]) => {
                    fixed.push(self.constant(ty, id, *given.get(&id).unwrap_or(&0)));
                    continue;
                }
                (op::CONSTANT | op::SPEC_CONSTANT, &[_, ty, id, value]) => {
                    fixed.push(self.constant(ty, id, *given.get(&id).unwrap_or(&value)));
                    continue;
                }
                // of 64 bits
                (op::SPEC_CONSTANT, _) => return None,
                (op::SPEC_CONSTANT_COMPOSITE, [_, operands @ ..]) => {
                    fixed.push(instruction(op::CONSTANT_COMPOSITE, operands));
                    continue;
                }
                (op::SPEC_CONSTANT_OP, [_, ty, id, what, operands @ ..]) => {
                    if let Some(Value::Is(value)) = self.fold(*what, operands) {
                        fixed.push(self.constant(*ty, *id, value));
                        continue;
                    }
                }
                _ => {}
            }
            fixed.push(words.to_vec());
        }
        Some(fixed)
    }

    /// Declares a constant of 32 bits or a boolean.
    fn constant(&mut self, ty: u32, id: u32, value: u32) -> Vec<u32> {
        let is_bool = self.bools.contains(&ty);
        if is_bool || self.words.contains(&ty) {
            self.values[id as usize] = Value::Is(value);
        }
        match (is_bool, value) {
            (true, 0) => instruction(op::CONSTANT_FALSE, &[ty, id]),
            (true, _) => instruction(op::CONSTANT_TRUE, &[ty, id]),
            (false, _) => instruction(op::CONSTANT, &[ty, id, value]),
        }
    }

    fn get(&self, id: u32) -> Value {
        // what is asked for may be a literal
        self.values
            .get(id as usize)
            .copied()
            .unwrap_or(Value::Varies)
    }

    /// What an operation gives; `None` of those that are not computed here.
    fn fold(&self, what: u32, operands: &[u32]) -> Option<Value> {
        let operand = |at: usize| operands.get(at).map_or(Value::Varies, |id| self.get(*id));
        let (a, b) = (operand(0), operand(1));
        Some(match what {
            op::LOGICAL_AND => a.unless(b, 0),
            op::LOGICAL_OR => a.unless(b, 1),
            op::LOGICAL_NOT => a.with(Value::Is(0), |a, _| u32::from(a == 0)),
            op::LOGICAL_EQUAL | op::I_EQUAL => a.with(b, |a, b| u32::from(a == b)),
            op::LOGICAL_NOT_EQUAL | op::I_NOT_EQUAL => a.with(b, |a, b| u32::from(a != b)),
            op::U_GREATER_THAN => a.with(b, |a, b| u32::from(a > b)),
            op::SELECT => match a {
                Value::Is(0) => operand(2),
                Value::Is(_) => b,
                other => other,
            },
            op::BITWISE_AND => a.with(b, |a, b| a & b),
            op::BITWISE_OR => a.with(b, |a, b| a | b),
            op::I_ADD => a.with(b, u32::wrapping_add),
            // shifts by 32 and more are undefined
            op::SHIFT_LEFT_LOGICAL => a.with(b, u32::wrapping_shl),
            op::SHIFT_RIGHT_LOGICAL => a.with(b, u32::wrapping_shr),
            _ => return None,
        })
    }

    /// What an instruction of a block gives that these lead to; `None` of those that are not computed here.
    fn compute(&self, words: &Words, from: &[u32]) -> Option<Value> {
        let operands = words.get(3..)?;
        match opcode(words) {
            op::PHI => Some(self.meet(operands, from)),
            what => self.fold(what, operands),
        }
    }

    /// What a block gets from those that lead to it.
    fn meet(&self, pairs: &[u32], from: &[u32]) -> Value {
        let pairs = pairs.chunks_exact(2).filter(|pair| from.contains(&pair[1]));
        let values = pairs.map(|pair| self.get(pair[0]));
        values.fold(Value::Open, |all, value| match (all, value) {
            (Value::Open, one) | (one, Value::Open) => one,
            (all, value) if all == value => all,
            _ => Value::Varies,
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const BOOL: u32 = 1;
    const INT: u32 = 2;

    /// A module of these instructions.
    fn words(instructions: &[(u32, &[u32])]) -> Vec<u32> {
        let mut words = vec![0x0723_0203, 0x0001_0300, 0, 100, 0];
        for (opcode, operands) in instructions {
            words.extend(instruction(*opcode, operands));
        }
        words
    }

    /// A decoration without meaning here.
    fn decorate(id: u32) -> (u32, [u32; 2]) {
        (op::DECORATE, [id, 42])
    }

    #[test]
    fn values_take_the_place_of_constants() {
        let module = words(&[
            (op::DECORATE, &[10, SPEC_ID, 0]),
            (op::DECORATE, &[11, SPEC_ID, 1]),
            (op::DECORATE, &[12, SPEC_ID, 2]),
            (op::TYPE_BOOL, &[BOOL]),
            (op::TYPE_INT, &[INT, 32, 0]),
            (op::SPEC_CONSTANT_TRUE, &[BOOL, 10]),
            (op::SPEC_CONSTANT_FALSE, &[BOOL, 11]),
            (op::SPEC_CONSTANT, &[INT, 12, 5]),
            (op::CONSTANT, &[INT, 13, 6]),
            (op::SPEC_CONSTANT_OP, &[BOOL, 14, op::LOGICAL_OR, 10, 11]),
            (op::SPEC_CONSTANT_OP, &[BOOL, 15, op::LOGICAL_NOT, 14]),
            (op::SPEC_CONSTANT_OP, &[INT, 16, op::SELECT, 15, 12, 13]),
            (op::SPEC_CONSTANT_OP, &[BOOL, 17, op::I_EQUAL, 16, 12]),
            (op::SPEC_CONSTANT_OP, &[INT, 18, op::I_ADD, 16, 13]),
            (op::SPEC_CONSTANT_COMPOSITE, &[3, 19, 16, 18]),
            (
                op::SPEC_CONSTANT_OP,
                &[BOOL, 20, op::U_GREATER_THAN, 18, 16],
            ),
        ]);
        // 11 keeps its own
        let expected = words(&[
            (op::TYPE_BOOL, &[BOOL]),
            (op::TYPE_INT, &[INT, 32, 0]),
            (op::CONSTANT_FALSE, &[BOOL, 10]),
            (op::CONSTANT_FALSE, &[BOOL, 11]),
            (op::CONSTANT, &[INT, 12, 9]),
            (op::CONSTANT, &[INT, 13, 6]),
            (op::CONSTANT_FALSE, &[BOOL, 14]),
            (op::CONSTANT_TRUE, &[BOOL, 15]),
            (op::CONSTANT, &[INT, 16, 9]),
            (op::CONSTANT_TRUE, &[BOOL, 17]),
            (op::CONSTANT, &[INT, 18, 15]),
            (op::CONSTANT_COMPOSITE, &[3, 19, 16, 18]),
            (op::CONSTANT_TRUE, &[BOOL, 20]),
        ]);
        assert_eq!(specialised(&module, &[(0, 0), (2, 9)]), expected);
    }

    /// `if (10) { 40 = load } else { 41 = load }`, then `if (10 && 42)`, which a phi tells, and a merge that nothing reaches.
    #[test]
    fn what_no_path_reaches_is_left_out() {
        let load = 61;
        let (gone, kept) = (decorate(41), decorate(40));
        let start: [(u32, &[u32]); 5] = [
            (op::TYPE_BOOL, &[BOOL]),
            (op::CONSTANT_TRUE, &[BOOL, 10]),
            (op::CONSTANT_FALSE, &[BOOL, 11]),
            (op::FUNCTION, &[3, 20, 0, 4]),
            (op::LABEL, &[30]),
        ];
        let mut module: Vec<(u32, &[u32])> = vec![(gone.0, &gone.1), (kept.0, &kept.1)];
        module.extend(start);
        module.extend([
            (op::SELECTION_MERGE, &[33, 0][..]),
            (op::BRANCH_CONDITIONAL, &[10, 31, 32]),
            (op::LABEL, &[31]),
            (load, &[BOOL, 40, 50]),
            (op::BRANCH, &[33]),
            (op::LABEL, &[32]),
            (load, &[BOOL, 41, 50]),
            (op::BRANCH, &[33]),
            (op::LABEL, &[33]),
            (op::PHI, &[BOOL, 42, 11, 31, 41, 32]),
            (op::LOGICAL_AND, &[BOOL, 43, 42, 40]),
            (op::SELECTION_MERGE, &[36, 0]),
            (op::BRANCH_CONDITIONAL, &[43, 34, 35]),
            (op::LABEL, &[34]),
            (op::BRANCH, &[36]),
            (op::LABEL, &[35]),
            (op::SELECTION_MERGE, &[39, 0]),
            (op::BRANCH_CONDITIONAL, &[40, 37, 38]),
            (op::LABEL, &[37]),
            (op::SELECTION_MERGE, &[45, 0]),
            (op::BRANCH_CONDITIONAL, &[10, 46, 45]),
            (op::LABEL, &[46]),
            (op::UNREACHABLE, &[]),
            (op::LABEL, &[45]),
            (op::BRANCH, &[39]),
            (op::LABEL, &[38]),
            (op::UNREACHABLE, &[]),
            (op::LABEL, &[39]),
            (op::BRANCH, &[36]),
            (op::LABEL, &[36]),
            (op::UNREACHABLE, &[]),
            (op::FUNCTION_END, &[]),
        ]);
        let mut expected: Vec<(u32, &[u32])> = vec![(kept.0, &kept.1)];
        expected.extend(start);
        expected.extend([
            (op::BRANCH, &[31][..]),
            (op::LABEL, &[31]),
            (load, &[BOOL, 40, 50]),
            (op::BRANCH, &[33]),
            (op::LABEL, &[33]),
            (op::PHI, &[BOOL, 42, 11, 31]),
            (op::LOGICAL_AND, &[BOOL, 43, 42, 40]),
            (op::BRANCH, &[35]),
            (op::LABEL, &[35]),
            (op::SELECTION_MERGE, &[39, 0]),
            (op::BRANCH_CONDITIONAL, &[40, 37, 38]),
            (op::LABEL, &[37]),
            (op::BRANCH, &[46]),
            (op::LABEL, &[46]),
            (op::UNREACHABLE, &[]),
            (op::LABEL, &[38]),
            (op::UNREACHABLE, &[]),
            (op::LABEL, &[39]),
            (op::UNREACHABLE, &[]),
            (op::FUNCTION_END, &[]),
        ]);
        assert_eq!(specialised(&words(&module), &[]), words(&expected));
    }

    /// `for (40 = 10;; 40 = 41) { 41 = !40; if (10) break; }`
    #[test]
    fn a_loop_that_is_not_repeated_stays_one() {
        let start: [(u32, &[u32]); 6] = [
            (op::TYPE_BOOL, &[BOOL]),
            (op::CONSTANT_TRUE, &[BOOL, 10]),
            (op::FUNCTION, &[3, 20, 0, 4]),
            (op::LABEL, &[30]),
            (op::BRANCH, &[31]),
            (op::LABEL, &[31]),
        ];
        let end: [(u32, &[u32]); 3] = [
            (op::LABEL, &[35]),
            (op::UNREACHABLE, &[]),
            (op::FUNCTION_END, &[]),
        ];
        let body: [(u32, &[u32]); 4] = [
            (op::LOOP_MERGE, &[35, 34, 0]),
            (op::BRANCH, &[32]),
            (op::LABEL, &[32]),
            (op::LOGICAL_NOT, &[BOOL, 41, 40]),
        ];
        let mut module = start.to_vec();
        module.push((op::PHI, &[BOOL, 40, 10, 30, 41, 34]));
        module.extend(body);
        module.extend([
            (op::SELECTION_MERGE, &[33, 0][..]),
            (op::BRANCH_CONDITIONAL, &[10, 35, 33]),
            (op::LABEL, &[33]),
            (op::BRANCH, &[34]),
            (op::LABEL, &[34]),
            (op::BRANCH, &[31]),
        ]);
        module.extend(end);
        let mut expected = start.to_vec();
        expected.push((op::PHI, &[BOOL, 40, 10, 30, 40, 34]));
        expected.extend(body);
        expected.extend([
            (op::BRANCH, &[35][..]),
            (op::LABEL, &[34]),
            (op::BRANCH, &[31]),
        ]);
        expected.extend(end);
        assert_eq!(specialised(&words(&module), &[]), words(&expected));
    }
}
