//! Numbers a SPIR-V module's bindings anew: wgpu's Vulkan layer gives them consecutive numbers, which a module that passes by
//! must have.

/// Words before the first instruction.
const HEADER: usize = 5;

// Enumerations of the SPIR-V specification: 3.20, decorations, and 3.49, instructions.
const DECORATION_NON_WRITABLE: u32 = 24;
const DECORATION_BINDING: u32 = 33;
const OP_DECORATE: u32 = 71;

/// The module with each binding numbered by its place in `bindings`, which also say what is only read: naga looks for that at
/// the variable, and glslang notes it at the block's member.
///
/// # Panics
/// The module binds what is not in the list.
pub(super) fn numbered(words: &[u32], bindings: &[(u32, bool)]) -> Vec<u32> {
    let mut numbered = words[..HEADER].to_vec();
    let mut rest = &words[HEADER..];
    while let Some(&first) = rest.first() {
        let (instruction, after) = rest.split_at((first >> 16) as usize);
        rest = after;
        let mut new = instruction.to_vec();
        if first & 0xFFFF == OP_DECORATE && instruction[2] == DECORATION_BINDING {
            let place = bindings.iter().position(|(at, _)| *at == instruction[3]);
            let place = place.expect("the list holds all bindings of the kernel");
            new[3] = place as u32;
            if bindings[place].1 {
                let not_written = [instruction[1], DECORATION_NON_WRITABLE];
                new.push(3 << 16 | OP_DECORATE);
                new.extend(not_written);
            }
        }
        numbered.extend(new);
    }
    numbered
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bindings_get_consecutive_numbers() {
        let decorate = |result, what: &[u32]| {
            let length = what.len() as u32 + 2;
            [&[length << 16 | OP_DECORATE, result], what].concat()
        };
        let binding = |result, at| decorate(result, &[DECORATION_BINDING, at]);
        let module = |instructions: &[Vec<u32>]| {
            let header = vec![0x0723_0203, 0x0001_0300, 0, 100, 0];
            [header, instructions.concat()].concat()
        };
        let words = module(&[binding(10, 0), binding(11, 14), binding(12, 3)]);
        let expected = module(&[
            binding(10, 0),
            binding(11, 2),
            decorate(11, &[DECORATION_NON_WRITABLE]),
            binding(12, 1),
        ]);
        let list = [(0, false), (3, false), (14, true)];
        assert_eq!(numbered(&words, &list), expected);
    }
}
