//! Positions of the nodes of a graph in a picture, and the points of its arrows.
//!
//! In layers, after Sugiyama: a node stands in the column of its distance from the first ones. An arrow back over several
//! columns passes each of them at a place of its own, so that it crosses no node. Within a column the order follows the
//! neighbours (barycentres), and the heights come as near to the neighbours' as the order allows (isotonic regression).

use std::collections::{BTreeMap, VecDeque};

/// x and y in pixels, y downwards.
pub(crate) type Point = (f64, f64);

/// Pixels between columns besides the labels, and between what stands in one.
const COLUMN_GAP: f64 = 64.0;
const ROW_GAP: f64 = 34.0;

/// How often orders and heights are bettered.
const SWEEPS: usize = 12;

/// What is to be drawn.
#[derive(Debug, Clone, Default)]
pub(crate) struct Graph {
    /// Half the width and half the height of each node.
    pub(crate) nodes: Vec<Point>,
    /// From, to, and the width and height of the label.
    pub(crate) arrows: Vec<(usize, usize, Point)>,
    /// The nodes of the first column.
    pub(crate) first: Vec<usize>,
}

/// Where it is drawn.
#[derive(Debug, Clone)]
pub(crate) struct Layout {
    /// The centre of each node.
    pub(crate) nodes: Vec<Point>,
    /// The points between source and target of each arrow.
    pub(crate) bends: Vec<Vec<Point>>,
}

/// Something in a column: a node, or an arrow that passes.
struct Item {
    half: Point,
    neighbours: Vec<usize>,
    y: f64,
}

pub(crate) fn lay_out(graph: &Graph) -> Layout {
    let column_of = columns_of(graph);
    let count = column_of.iter().max().map_or(0, |last| last + 1);
    let mut columns: Vec<Vec<usize>> = vec![Vec::new(); count];
    let mut items: Vec<Item> = Vec::new();
    for (&half, &column) in graph.nodes.iter().zip(&column_of) {
        columns[column].push(items.len());
        items.push(Item { half, neighbours: Vec::new(), y: 0.0 });
    }
    let mut passing: Vec<Vec<usize>> = Vec::new();
    let mut label_width = vec![0.0_f64; count];
    for &(from, to, label) in &graph.arrows {
        let (low, high) = (column_of[from].min(column_of[to]), column_of[from].max(column_of[to]));
        if high == low + 1 {
            label_width[low] = label_width[low].max(label.0);
        }
        let mut path = Vec::new();
        let mut before = if column_of[from] == low { from } else { to };
        let last = if before == from { to } else { from };
        for column in columns.iter_mut().take(high).skip(low + 1) {
            let item = items.len();
            column.push(item);
            items.push(Item {
                half: (label.0 / 2.0, label.1 / 2.0),
                neighbours: vec![before],
                y: 0.0,
            });
            items[before].neighbours.push(item);
            path.push(item);
            before = item;
        }
        if high > low {
            items[before].neighbours.push(last);
            items[last].neighbours.push(before);
        }
        if column_of[from] == high {
            path.reverse();
        }
        passing.push(path);
    }
    order(&mut columns, &mut items);
    let x = abscissae(&columns, &items, &label_width);
    let mut places = vec![(0.0, 0.0); items.len()];
    for (column, members) in columns.iter().enumerate() {
        for &item in members {
            places[item] = (x[column], items[item].y);
        }
    }
    Layout {
        nodes: places[..graph.nodes.len()].to_vec(),
        bends: passing.iter().map(|path| path.iter().map(|&item| places[item]).collect()).collect(),
    }
}

/// Distances from the first nodes; what is not reached from them begins anew in the first column.
fn columns_of(graph: &Graph) -> Vec<usize> {
    let mut targets: BTreeMap<usize, Vec<usize>> = BTreeMap::new();
    for &(from, to, _) in &graph.arrows {
        targets.entry(from).or_default().push(to);
    }
    let mut columns: Vec<Option<usize>> = vec![None; graph.nodes.len()];
    let mut begin = |start: &[usize]| {
        let mut pending: VecDeque<usize> = VecDeque::new();
        for &node in start {
            if columns[node].is_none() {
                columns[node] = Some(0);
                pending.push_back(node);
            }
        }
        while let Some(node) = pending.pop_front() {
            let next = columns[node].map(|column| column + 1);
            for &target in targets.get(&node).into_iter().flatten() {
                if columns[target].is_none() {
                    columns[target] = next;
                    pending.push_back(target);
                }
            }
        }
    };
    begin(&graph.first);
    for node in 0..graph.nodes.len() {
        begin(&[node]);
    }
    columns.into_iter().map(|column| column.unwrap_or(0)).collect()
}

/// Orders each column by its neighbours, and gives heights.
fn order(columns: &mut [Vec<usize>], items: &mut [Item]) {
    for column in columns.iter() {
        stack(column, items, &vec![0.0; column.len()]);
    }
    for sweep in 0..SWEEPS {
        let count = columns.len();
        for step in 0..count {
            let column = if sweep % 2 == 0 { step } else { count - 1 - step };
            let column = &mut columns[column];
            // In the last sweeps only the heights change.
            if sweep < SWEEPS * 2 / 3 {
                let keys: BTreeMap<usize, f64> =
                    column.iter().map(|&item| (item, barycentre(items, item))).collect();
                column.sort_by(|left, right| keys[left].total_cmp(&keys[right]));
            }
            let wanted: Vec<f64> = column.iter().map(|&item| barycentre(items, item)).collect();
            stack(column, items, &wanted);
        }
    }
}

fn barycentre(items: &[Item], item: usize) -> f64 {
    let neighbours = &items[item].neighbours;
    if neighbours.is_empty() {
        return items[item].y;
    }
    let sum: f64 = neighbours.iter().map(|&other| items[other].y).sum();
    sum / neighbours.len() as f64
}

/// Heights for a column in its order, as near to the wanted ones as the sizes allow: least squares, by pooling neighbours that
/// want to be too near.
fn stack(column: &[usize], items: &mut [Item], wanted: &[f64]) {
    let mut offsets = Vec::with_capacity(column.len());
    let mut offset = 0.0;
    for (place, &item) in column.iter().enumerate() {
        if place > 0 {
            offset += items[column[place - 1]].half.1 + items[item].half.1 + ROW_GAP;
        }
        offsets.push(offset);
    }
    // Blocks of the sum of what their members want, and how many they are.
    let mut blocks: Vec<(f64, usize)> = Vec::new();
    for (wanted, offset) in wanted.iter().zip(&offsets) {
        blocks.push((wanted - offset, 1));
        while let [.., (low, few), (high, many)] = blocks[..]
            && low / few as f64 > high / many as f64
        {
            blocks.pop();
            blocks.pop();
            blocks.push((low + high, few + many));
        }
    }
    let heights =
        blocks.iter().flat_map(|&(sum, count)| std::iter::repeat_n(sum / count as f64, count));
    for ((&item, height), offset) in column.iter().zip(heights).zip(offsets) {
        items[item].y = height + offset;
    }
}

/// The middle of each column.
fn abscissae(columns: &[Vec<usize>], items: &[Item], label_width: &[f64]) -> Vec<f64> {
    let half = |column: &Vec<usize>| {
        let widths = column.iter().map(|&item| items[item].half.0);
        widths.fold(0.0, f64::max)
    };
    let mut x = 0.0;
    let mut middles = Vec::with_capacity(columns.len());
    for (number, column) in columns.iter().enumerate() {
        if number > 0 {
            x += half(&columns[number - 1]) + label_width[number - 1] + COLUMN_GAP + half(column);
        }
        middles.push(x);
    }
    middles
}
