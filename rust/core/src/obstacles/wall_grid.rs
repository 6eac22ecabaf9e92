//! Walls and other polygons in a grid, so that far ones cost nothing.

use nalgebra::Vector2;

use super::{ConvexPolygon, Rectangle};

/// A polygon with the rectangle around it.
#[derive(Debug, Clone, PartialEq)]
pub struct Wall {
    pub polygon: ConvexPolygon,
    pub rectangle: Rectangle,
}

impl Wall {
    pub fn new(polygon: ConvexPolygon) -> Self {
        Self { rectangle: polygon.rectangle(), polygon }
    }
}

/// Walls of any length, sorted into square cells: each is in all the cells that its rectangle meets.
#[derive(Debug, Clone, Default)]
pub struct WallGrid {
    walls: Vec<Wall>,
    origin: Vector2<f64>,
    cell: f64,
    columns: usize,
    rows: usize,
    /// `order[start[c]..start[c + 1]]` are the walls in cell `c`.
    start: Vec<u32>,
    order: Vec<u32>,
}

/// A rectangle of cells, bounds included.
#[derive(Clone, Copy)]
struct Cells {
    columns: [usize; 2],
    rows: [usize; 2],
}

impl Cells {
    /// Row and column of each cell.
    fn cells(self) -> impl Iterator<Item = (usize, usize)> {
        let Self { columns, rows } = self;
        (rows[0]..=rows[1]).flat_map(move |row| (columns[0]..=columns[1]).map(move |column| (row, column)))
    }
}

impl WallGrid {
    pub fn new(polygons: impl Iterator<Item = ConvexPolygon>) -> Self {
        let mut grid = Self { walls: polygons.map(Wall::new).collect(), ..Self::default() };
        if !grid.walls.is_empty() {
            grid.lay_out_cells();
            grid.sort_into_cells();
        }
        grid
    }

    pub fn walls(&self) -> &[Wall] {
        &self.walls
    }

    /// Every wall, once, whose rectangle lies within `distance` of a point.
    pub fn near(&self, point: Vector2<f64>, distance: f64) -> impl Iterator<Item = usize> {
        let around = Rectangle { low: point.add_scalar(-distance), high: point.add_scalar(distance) };
        let asked = (!self.walls.is_empty()).then(|| self.cells(&around));
        asked.into_iter().flat_map(move |asked| {
            asked.cells().flat_map(move |(row, column)| {
                let walls = self.in_cell(row * self.columns + column).iter().map(|&index| index as usize);
                walls.filter(move |&index| {
                    let wall = &self.walls[index];
                    let own = self.cells(&wall.rectangle);
                    // A wall in several of the cells counts in the first of them.
                    let is_first =
                        row == own.rows[0].max(asked.rows[0]) && column == own.columns[0].max(asked.columns[0]);
                    is_first && wall.rectangle.distance(&point) <= distance
                })
            })
        })
    }

    fn in_cell(&self, cell: usize) -> &[u32] {
        &self.order[self.start[cell] as usize..self.start[cell + 1] as usize]
    }

    /// About as many cells as walls.
    fn lay_out_cells(&mut self) {
        let Rectangle { low, high } =
            Rectangle::around(self.walls.iter().flat_map(|Wall { rectangle, .. }| [rectangle.low, rectangle.high]));
        let (size, count) = (high - low, self.walls.len() as f64);
        self.cell = (size.x * size.y / count).sqrt().max(size.max() / count).max(MIN_CELL);
        self.origin = low;
        self.columns = (size.x / self.cell) as usize + 1;
        self.rows = (size.y / self.cell) as usize + 1;
    }

    fn sort_into_cells(&mut self) {
        let count = self.columns * self.rows;
        let mut lists = vec![Vec::new(); count];
        for (index, wall) in self.walls.iter().enumerate() {
            for (row, column) in self.cells(&wall.rectangle).cells() {
                lists[row * self.columns + column].push(index as u32);
            }
        }
        self.start = Vec::with_capacity(count + 1);
        self.start.push(0);
        for list in lists {
            self.order.extend(list);
            self.start.push(self.order.len() as u32);
        }
    }

    /// The cells that a rectangle meets; one outside the grid counts as at its border.
    fn cells(&self, Rectangle { low, high }: &Rectangle) -> Cells {
        let index = |value: f64, axis: usize, count: usize| {
            let cell = (value - self.origin[axis]) / self.cell;
            (cell.max(0.0) as usize).min(count - 1)
        };
        let range = |axis, count| [index(low[axis], axis, count), index(high[axis], axis, count)];
        Cells { columns: range(0, self.columns), rows: range(1, self.rows) }
    }
}

/// Smallest cell \[m\].
const MIN_CELL: f64 = 0.2;
