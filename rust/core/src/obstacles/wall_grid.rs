//! Walls and other polygons in a grid, so that far ones cost nothing.

use nalgebra::Vector2;

use super::ConvexPolygon;

/// A polygon with the rectangle around it.
#[derive(Debug, Clone, PartialEq)]
pub struct Wall {
    pub polygon: ConvexPolygon,
    low: Vector2<f64>,
    high: Vector2<f64>,
}

impl Wall {
    pub fn new(polygon: ConvexPolygon) -> Self {
        let vertices = polygon.vertices();
        let low = vertices.iter().fold(Vector2::repeat(f64::INFINITY), |low, vertex| low.inf(vertex));
        let high = vertices.iter().fold(Vector2::repeat(f64::NEG_INFINITY), |high, vertex| high.sup(vertex));
        Self { polygon, low, high }
    }

    /// Lower bound on the distance of a point \[m\].
    pub fn distance_bound(&self, point: &Vector2<f64>) -> f64 {
        (self.low - point).sup(&(point - self.high)).sup(&Vector2::zeros()).norm()
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
    fn places(self) -> impl Iterator<Item = (usize, usize)> {
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
        let asked =
            (!self.walls.is_empty()).then(|| self.cells(&point.add_scalar(-distance), &point.add_scalar(distance)));
        asked.into_iter().flat_map(move |asked| {
            asked.places().flat_map(move |(row, column)| {
                let walls = self.in_cell(row * self.columns + column).iter().map(|&index| index as usize);
                walls.filter(move |&index| {
                    let wall = &self.walls[index];
                    let own = self.cells(&wall.low, &wall.high);
                    // A wall in several of the cells counts in the first of them.
                    let is_first =
                        row == own.rows[0].max(asked.rows[0]) && column == own.columns[0].max(asked.columns[0]);
                    is_first && wall.distance_bound(&point) <= distance
                })
            })
        })
    }

    fn in_cell(&self, cell: usize) -> &[u32] {
        &self.order[self.start[cell] as usize..self.start[cell + 1] as usize]
    }

    /// About as many cells as walls.
    fn lay_out_cells(&mut self) {
        let low = self.walls.iter().fold(Vector2::repeat(f64::INFINITY), |low, wall| low.inf(&wall.low));
        let high = self.walls.iter().fold(Vector2::repeat(f64::NEG_INFINITY), |high, wall| high.sup(&wall.high));
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
            for (row, column) in self.cells(&wall.low, &wall.high).places() {
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
    fn cells(&self, low: &Vector2<f64>, high: &Vector2<f64>) -> Cells {
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
