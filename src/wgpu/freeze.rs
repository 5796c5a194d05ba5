//! Writes the values of specialisation constants into a SPIR-V module and numbers its bindings anew.
//! wgpu specialises nothing that passes it by, naga knows no OpSpecConstantOp, and wgpu's
//! Vulkan layer gives bindings consecutive numbers, which a module that passes by must have.

use std::collections::HashMap;

/// Words before the first instruction.
const HEADER: usize = 5;

// Enumerations of the SPIR-V specification: 3.20, decorations, and 3.49, instructions.
const DECORATION_SPEC_ID: u32 = 1;
const DECORATION_NON_WRITABLE: u32 = 24;
const DECORATION_BINDING: u32 = 33;
const OP_TYPE_BOOL: u32 = 20;
const OP_CONSTANT_TRUE: u32 = 41;
const OP_CONSTANT_FALSE: u32 = 42;
const OP_CONSTANT: u32 = 43;
const OP_CONSTANT_COMPOSITE: u32 = 44;
const OP_SPEC_CONSTANT_TRUE: u32 = 48;
const OP_SPEC_CONSTANT_FALSE: u32 = 49;
const OP_SPEC_CONSTANT: u32 = 50;
const OP_SPEC_CONSTANT_COMPOSITE: u32 = 51;
const OP_SPEC_CONSTANT_OP: u32 = 52;
const OP_DECORATE: u32 = 71;
const OP_LOGICAL_EQUAL: u32 = 164;
const OP_LOGICAL_NOT_EQUAL: u32 = 165;
const OP_LOGICAL_OR: u32 = 166;
const OP_LOGICAL_AND: u32 = 167;
const OP_LOGICAL_NOT: u32 = 168;
const OP_SELECT: u32 = 169;
const OP_I_EQUAL: u32 = 170;
const OP_I_NOT_EQUAL: u32 = 171;

/// The module with `constants` (id, value) in place of its specialisation constants, and each
/// binding numbered by its place in `bindings`, which also say what is only read: naga looks for that at the
/// variable, and glslang notes it at the block's member. Constants that are not named keep their default.
///
/// # Panics
/// The module computes a constant in a way that the kernels of this crate do not, or binds what is not in the list.
pub(super) fn freeze(
    words: &[u32],
    constants: &[(u32, u32)],
    bindings: &[(u32, bool)],
) -> Vec<u32> {
    let mut given: HashMap<u32, u32> = HashMap::new();
    // of scalar constants, by their result
    let mut values: HashMap<u32, u32> = HashMap::new();
    let mut bool_type = None;
    let mut frozen = words[..HEADER].to_vec();
    let mut rest = &words[HEADER..];
    while let Some(&first) = rest.first() {
        let (instruction, after) = rest.split_at((first >> 16) as usize);
        rest = after;
        let mut new = instruction.to_vec();
        let is_bool = |kind: u32| Some(kind) == bool_type;
        match first & 0xFFFF {
            OP_DECORATE if instruction[2] == DECORATION_SPEC_ID => {
                let named = constants.iter().find(|(id, _)| *id == instruction[3]);
                given.extend(named.map(|(_, value)| (instruction[1], *value)));
                continue;
            }
            OP_DECORATE if instruction[2] == DECORATION_BINDING => {
                let place = bindings.iter().position(|(at, _)| *at == instruction[3]);
                let place = place.expect("the list holds all bindings of the kernel");
                new[3] = place as u32;
                if bindings[place].1 {
                    new.extend([
                        3 << 16 | OP_DECORATE,
                        instruction[1],
                        DECORATION_NON_WRITABLE,
                    ]);
                }
            }
            OP_TYPE_BOOL => bool_type = Some(instruction[1]),
            op @ (OP_CONSTANT_TRUE | OP_CONSTANT_FALSE) => {
                values.insert(instruction[2], u32::from(op == OP_CONSTANT_TRUE));
            }
            OP_CONSTANT if instruction.len() == 4 => {
                values.insert(instruction[2], instruction[3]);
            }
            op @ (OP_SPEC_CONSTANT_TRUE | OP_SPEC_CONSTANT_FALSE) => {
                let default = u32::from(op == OP_SPEC_CONSTANT_TRUE);
                let value = *given.get(&instruction[2]).unwrap_or(&default);
                values.insert(instruction[2], value);
                new = constant(instruction[1], true, instruction[2], value);
            }
            OP_SPEC_CONSTANT => {
                assert_eq!(instruction.len(), 4, "constants have 32 bits");
                let value = *given.get(&instruction[2]).unwrap_or(&instruction[3]);
                values.insert(instruction[2], value);
                new = constant(instruction[1], false, instruction[2], value);
            }
            OP_SPEC_CONSTANT_COMPOSITE => new[0] = first & 0xFFFF_0000 | OP_CONSTANT_COMPOSITE,
            OP_SPEC_CONSTANT_OP => {
                let operands = instruction[4..].iter().map(|id| values[id]).collect();
                let value = compute(instruction[3], operands);
                values.insert(instruction[2], value);
                new = constant(
                    instruction[1],
                    is_bool(instruction[1]),
                    instruction[2],
                    value,
                );
            }
            _ => {}
        }
        frozen.extend(new);
    }
    frozen
}

fn constant(kind: u32, is_bool: bool, result: u32, value: u32) -> Vec<u32> {
    if !is_bool {
        return vec![4 << 16 | OP_CONSTANT, kind, result, value];
    }
    let op = if value == 0 {
        OP_CONSTANT_FALSE
    } else {
        OP_CONSTANT_TRUE
    };
    vec![3 << 16 | op, kind, result]
}

/// What an OpSpecConstantOp of these operands is.
fn compute(op: u32, operands: Vec<u32>) -> u32 {
    match (op, operands[..].first(), operands.get(1)) {
        (OP_LOGICAL_OR, Some(a), Some(b)) => a | b,
        (OP_LOGICAL_AND, Some(a), Some(b)) => a & b,
        (OP_LOGICAL_NOT, Some(a), None) => 1 - a,
        (OP_LOGICAL_EQUAL | OP_I_EQUAL, Some(a), Some(b)) => u32::from(a == b),
        (OP_LOGICAL_NOT_EQUAL | OP_I_NOT_EQUAL, Some(a), Some(b)) => u32::from(a != b),
        (OP_SELECT, Some(a), Some(b)) => {
            if *a != 0 {
                *b
            } else {
                operands[2]
            }
        }
        _ => panic!("no kernel computes a constant by operation {op}"),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// An instruction: its length stands in the upper half of the first word.
    fn op(code: u32, operands: &[u32]) -> Vec<u32> {
        let mut words = vec![(operands.len() as u32 + 1) << 16 | code];
        words.extend(operands);
        words
    }

    fn module(instructions: &[Vec<u32>]) -> Vec<u32> {
        [
            vec![0x0723_0203, 0x0001_0300, 0, 100, 0],
            instructions.concat(),
        ]
        .concat()
    }

    #[test]
    fn values_take_the_place_of_constants() {
        let (boolean, int) = (1, 2);
        let spec_id = |result, id| op(OP_DECORATE, &[result, DECORATION_SPEC_ID, id]);
        let words = module(&[
            spec_id(10, 0),
            spec_id(11, 1),
            spec_id(12, 2),
            op(OP_TYPE_BOOL, &[boolean]),
            op(OP_SPEC_CONSTANT_TRUE, &[boolean, 10]),
            op(OP_SPEC_CONSTANT_FALSE, &[boolean, 11]),
            op(OP_SPEC_CONSTANT, &[int, 12, 5]),
            op(OP_CONSTANT, &[int, 13, 6]),
            op(OP_SPEC_CONSTANT_OP, &[boolean, 14, OP_LOGICAL_OR, 10, 11]),
            op(OP_SPEC_CONSTANT_OP, &[boolean, 15, OP_LOGICAL_NOT, 14]),
            op(OP_SPEC_CONSTANT_OP, &[int, 16, OP_SELECT, 15, 12, 13]),
            op(OP_SPEC_CONSTANT_OP, &[boolean, 17, OP_I_EQUAL, 16, 12]),
        ]);
        // 11 keeps its default.
        let expected = module(&[
            op(OP_TYPE_BOOL, &[boolean]),
            op(OP_CONSTANT_FALSE, &[boolean, 10]),
            op(OP_CONSTANT_FALSE, &[boolean, 11]),
            op(OP_CONSTANT, &[int, 12, 9]),
            op(OP_CONSTANT, &[int, 13, 6]),
            op(OP_CONSTANT_FALSE, &[boolean, 14]),
            op(OP_CONSTANT_TRUE, &[boolean, 15]),
            op(OP_CONSTANT, &[int, 16, 9]),
            op(OP_CONSTANT_TRUE, &[boolean, 17]),
        ]);
        assert_eq!(freeze(&words, &[(0, 0), (2, 9)], &[]), expected);
    }

    #[test]
    fn bindings_get_consecutive_numbers() {
        let binding = |result, at| op(OP_DECORATE, &[result, DECORATION_BINDING, at]);
        let words = module(&[binding(10, 0), binding(11, 14), binding(12, 3)]);
        let expected = module(&[
            binding(10, 0),
            binding(11, 2),
            op(OP_DECORATE, &[11, DECORATION_NON_WRITABLE]),
            binding(12, 1),
        ]);
        let list = [(0, false), (3, false), (14, true)];
        assert_eq!(freeze(&words, &[], &list), expected);
    }
}
