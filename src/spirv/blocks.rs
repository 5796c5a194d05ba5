//! The blocks of a function that paths reach, and what is written of them.

use std::collections::{HashMap, HashSet};

use super::{Known, Value, Words, instruction, op, opcode};

/// The place of a number that is no label.
const NOWHERE: usize = usize::MAX;

/// A basic block.
struct Block<'a> {
    label: u32,
    /// From the label to the branch.
    instructions: &'a [&'a Words],
    /// The instruction that declares where the block's construct ends.
    merge: Option<&'a Words>,
}

impl Block<'_> {
    fn branch(&self) -> &Words {
        self.instructions[self.instructions.len() - 1]
    }

    fn is_loop(&self) -> bool {
        self.merge.is_some_and(|m| opcode(m) == op::LOOP_MERGE)
    }

    /// Labels that the branch names.
    fn targets(&self) -> Vec<u32> {
        let branch = self.branch();
        match opcode(branch) {
            op::BRANCH => vec![branch[1]],
            op::BRANCH_CONDITIONAL => vec![branch[2], branch[3]],
            // selectors are of 32 bits
            op::SWITCH => branch[2..].iter().step_by(2).copied().collect(),
            _ => Vec::new(),
        }
    }
}

/// A function as a graph of blocks.
pub struct Function<'a> {
    /// Before the first block.
    start: &'a [&'a Words],
    blocks: Vec<Block<'a>>,
    /// Of blocks, by their labels; `NOWHERE` of other numbers.
    places: Vec<usize>,
    end: &'a Words,
}

/// What paths reach, by block.
pub struct Reach {
    /// Blocks that branch to it; of those that are not reached none.
    from: Vec<Vec<u32>>,
    /// Where the only way goes on, of blocks that branched.
    only: Vec<Option<u32>>,
}

/// What is left of functions.
pub struct Body {
    pub words: Vec<u32>,
    /// What became of numbers that instructions name first after a type: their results, among others.
    pub left: Vec<Left>,
}

/// What became of a result.
#[derive(Clone, Copy, PartialEq, Eq)]
pub enum Left {
    Unknown,
    Gone,
    Kept,
}

impl<'a> Function<'a> {
    /// All words of a function; numbers are below `bound`.
    pub fn new(all: &'a [&'a Words], bound: usize) -> Option<Self> {
        let (end, all) = all.split_last()?;
        let is_label = |words: &&Words| opcode(words) == op::LABEL;
        let first = all.iter().position(is_label).unwrap_or(all.len());
        let (start, mut rest) = all.split_at(first);
        let mut blocks = Vec::new();
        while let Some(label) = rest.first() {
            let next = rest[1..].iter().position(is_label);
            let (instructions, others) = rest.split_at(next.map_or(rest.len(), |at| at + 1));
            let merge = instructions.iter().rev().nth(1).copied();
            let merge =
                merge.filter(|m| [op::LOOP_MERGE, op::SELECTION_MERGE].contains(&opcode(m)));
            blocks.push(Block {
                label: label[1],
                instructions,
                merge,
            });
            rest = others;
        }
        let mut places = vec![NOWHERE; bound];
        for (at, block) in blocks.iter().enumerate() {
            places[block.label as usize] = at;
        }
        let function = Self {
            start,
            blocks,
            places,
            end,
        };
        let mut targets = function.blocks.iter().flat_map(Block::targets);
        let are_there = targets.all(|label| function.places[label as usize] != NOWHERE);
        are_there.then_some(function)
    }

    fn place(&self, label: u32) -> usize {
        self.places[label as usize]
    }

    /// Blocks in reverse postorder: each after those that lead to it, but for the ways back to the start of a loop.
    fn order(&self) -> Vec<usize> {
        let mut order = Vec::new();
        let mut seen = vec![false; self.blocks.len()];
        let mut stack = Vec::new();
        if let Some(entry) = self.blocks.first() {
            seen[0] = true;
            stack.push((0, entry.targets()));
        }
        while let Some((at, targets)) = stack.last_mut() {
            match targets.pop() {
                None => {
                    order.push(*at);
                    stack.pop();
                }
                Some(label) => {
                    let next = self.place(label);
                    if !seen[next] {
                        seen[next] = true;
                        stack.push((next, self.blocks[next].targets()));
                    }
                }
            }
        }
        order.reverse();
        order
    }

    /// Follows the branches that are not ruled out, until nothing new is known: values of results are open at first, and what
    /// is learned of one is that it varies.
    pub fn reach(&self, known: &mut Known) -> Reach {
        let mut reach = Reach {
            from: vec![Vec::new(); self.blocks.len()],
            only: vec![None; self.blocks.len()],
        };
        let order = self.order();
        for words in self.blocks.iter().flat_map(|block| block.instructions) {
            if known.compute(words, &[]).is_some() {
                known.values[words[2] as usize] = Value::Open;
            }
        }
        loop {
            let mut is_new = false;
            for &at in &order {
                is_new |= self.follow(at, known, &mut reach);
            }
            if !is_new {
                return reach;
            }
        }
    }

    /// Follows a block, where it is reached; whether that tells anything new.
    fn follow(&self, at: usize, known: &mut Known, reach: &mut Reach) -> bool {
        let block = &self.blocks[at];
        if at != 0 && reach.from[at].is_empty() {
            return false;
        }
        let mut is_new = false;
        for words in block.instructions {
            let Some(value) = known.compute(words, &reach.from[at]) else {
                continue;
            };
            let before = std::mem::replace(&mut known.values[words[2] as usize], value);
            is_new |= before != value;
        }
        let branch = block.branch();
        let is_selection = block.merge.is_some() && !block.is_loop();
        reach.only[at] = match opcode(branch) {
            op::BRANCH_CONDITIONAL if is_selection => match known.get(branch[1]) {
                Value::Is(0) => Some(branch[3]),
                Value::Is(_) => Some(branch[2]),
                _ => None,
            },
            _ => None,
        };
        let targets = reach.only[at].map_or_else(|| block.targets(), |label| vec![label]);
        for label in targets {
            let from = &mut reach.from[self.place(label)];
            if !from.contains(&block.label) {
                from.push(block.label);
                is_new = true;
            }
        }
        is_new
    }

    /// Writes what is reached, and stubs where constructs that are left end in what is not.
    pub fn emit(&self, reach: &Reach, body: &mut Body) {
        let is_reached = |at: usize| at == 0 || !reach.from[at].is_empty();
        // labels of merge blocks and, with the starts of their loops, of continue targets
        let mut ends = HashSet::new();
        let mut repeats = HashMap::new();
        for (at, block) in self.blocks.iter().enumerate() {
            let Some(merge) = block
                .merge
                .filter(|_| is_reached(at) && reach.only[at].is_none())
            else {
                continue;
            };
            ends.insert(merge[1]);
            if block.is_loop() && !is_reached(self.place(merge[2])) {
                repeats.insert(merge[2], block.label);
            }
        }
        self.start.iter().for_each(|words| body.keep(words));
        for (at, block) in self.blocks.iter().enumerate() {
            if is_reached(at) {
                let again = block
                    .merge
                    .filter(|m| block.is_loop() && repeats.contains_key(&m[2]));
                for words in block.instructions {
                    match opcode(words) {
                        op::PHI => {
                            let mut phi = phi(words, &reach.from[at]);
                            // the loop is not repeated, so that any value will do
                            phi.extend(again.iter().flat_map(|m| [words[2], m[2]]));
                            body.keep(&instruction(op::PHI, &phi));
                        }
                        op::SELECTION_MERGE if reach.only[at].is_some() => {}
                        op::BRANCH_CONDITIONAL => match reach.only[at] {
                            Some(label) => body.keep(&instruction(op::BRANCH, &[label])),
                            None => body.keep(words),
                        },
                        _ => body.keep(words),
                    }
                }
                continue;
            }
            let gone = block.instructions.iter().filter_map(|words| words.get(2));
            gone.for_each(|id| body.note(*id, Left::Gone));
            let stub = match repeats.get(&block.label) {
                Some(start) => instruction(op::BRANCH, &[*start]),
                None if ends.contains(&block.label) => instruction(op::UNREACHABLE, &[]),
                None => continue,
            };
            body.keep(&instruction(op::LABEL, &[block.label]));
            body.keep(&stub);
        }
        body.keep(self.end);
    }
}

impl Body {
    pub fn new(bound: usize) -> Self {
        Self {
            words: Vec::new(),
            left: vec![Left::Unknown; bound],
        }
    }

    fn keep(&mut self, words: &Words) {
        if let Some(id) = words.get(2) {
            self.note(*id, Left::Kept);
        }
        self.words.extend_from_slice(words);
    }

    /// What is kept in one place is kept; a word that is no number of a result may be beyond all.
    pub fn note(&mut self, id: u32, left: Left) {
        if let Some(known) = self.left.get_mut(id as usize) {
            if *known != Left::Kept {
                *known = left;
            }
        }
    }
}

/// Type, result and pairs of the ways that are left.
fn phi(words: &Words, from: &[u32]) -> Vec<u32> {
    let pairs = words[3..].chunks_exact(2);
    let pairs = pairs.filter(|pair| from.contains(&pair[1]));
    let mut operands = words[1..3].to_vec();
    operands.extend(pairs.flatten());
    operands
}
