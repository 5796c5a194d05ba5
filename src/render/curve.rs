//! An order of the cells of a grid in which neighbours stay together.
//!
//! \[Hilbert91\] Hilbert, Ueber die stetige Abbildung einer Linie auf ein Flächenstück.

/// Calls `visit` with the index, row by row, of each of `width` × `height` cells in the order of a Hilbert curve over the
/// smallest square whose side is a power of two and that holds them.
pub(crate) fn along_hilbert(size: [usize; 2], visit: &mut impl FnMut(usize)) {
    let side = size[0].max(size[1]).next_power_of_two();
    square([0, 0], side, [false; 2], size, visit);
}

/// The part of the curve in a square: from its corner (0, 0) to (1, 0), after its axes are changed for each other
/// and both are turned round.
fn square(
    corner: [usize; 2],
    side: usize,
    [is_swapped, is_turned]: [bool; 2],
    size: [usize; 2],
    visit: &mut impl FnMut(usize),
) {
    if corner[0] >= size[0] || corner[1] >= size[1] {
        return;
    }
    if side == 1 {
        return visit(corner[1] * size[0] + corner[0]);
    }
    let half = side / 2;
    let quarters = [
        ([false, false], [!is_swapped, is_turned]),
        ([false, true], [is_swapped, is_turned]),
        ([true, true], [is_swapped, is_turned]),
        ([true, false], [!is_swapped, !is_turned]),
    ];
    for ([x, y], inside) in quarters {
        let [x, y] = if is_swapped { [y, x] } else { [x, y] };
        let far = |is_far: bool| if is_far != is_turned { half } else { 0 };
        let at = [corner[0] + far(x), corner[1] + far(y)];
        square(at, half, inside, size, visit);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_curve_goes_from_neighbour_to_neighbour() {
        let mut seen = Vec::new();
        along_hilbert([16, 16], &mut |index| seen.push(index));
        assert_eq!((seen[0], seen[255]), (0, 15));
        for pair in seen.windows(2) {
            let [a, b] = [pair[0], pair[1]].map(|i| [i % 16, i / 16]);
            assert_eq!(a[0].abs_diff(b[0]) + a[1].abs_diff(b[1]), 1, "{pair:?}");
        }
    }

    #[test]
    fn every_cell_is_visited_once() {
        for size in [[1, 1], [5, 3], [3, 9], [16, 9]] {
            let mut seen = Vec::new();
            along_hilbert(size, &mut |index| seen.push(index));
            seen.sort_unstable();
            assert!(seen.into_iter().eq(0..size[0] * size[1]), "{size:?}");
        }
    }
}
