// Small charts of numbers that change all the time, on plain canvases.

const BAR = "#0072b2", LINE = "#d55e00", AXIS = "#8b959b";

function prepare(canvas) {
  const ratio = window.devicePixelRatio || 1;
  const width = canvas.clientWidth, height = canvas.clientHeight;
  if (canvas.width !== Math.round(width * ratio)) {
    canvas.width = Math.round(width * ratio);
    canvas.height = Math.round(height * ratio);
  }
  const pen = canvas.getContext("2d");
  pen.setTransform(ratio, 0, 0, ratio, 0, 0);
  pen.clearRect(0, 0, width, height);
  pen.font = "10px system-ui, sans-serif";
  pen.fillStyle = AXIS;
  return [pen, width, height];
}

// The last values of a positive quantity on a logarithmic axis.
export class Strip {
  constructor(canvas, [low, high], length = 240) {
    Object.assign(this, {canvas, low: Math.log10(low), high: Math.log10(high), length, values: []});
  }

  add(value) {
    this.values.push(value);
    if (this.values.length > this.length) this.values.shift();
  }

  draw() {
    const [pen, width, height] = prepare(this.canvas);
    const y = (power) => (height - 12) * (1 - (power - this.low) / (this.high - this.low)) + 6;
    pen.strokeStyle = AXIS;
    pen.lineWidth = 0.4;
    for (let power = Math.ceil(this.low); power <= this.high; power += 6) {
      pen.beginPath();
      pen.moveTo(26, y(power));
      pen.lineTo(width, y(power));
      pen.stroke();
      pen.fillText(`1e${power}`, 0, y(power) + 3);
    }
    pen.strokeStyle = LINE;
    pen.lineWidth = 1.3;
    pen.beginPath();
    this.values.forEach((value, k) => {
      const power = Math.min(this.high, Math.max(this.low, Math.log10(Math.max(value, 1e-300))));
      pen.lineTo(26 + (width - 26) * k / (this.length - 1), y(power));
    });
    pen.stroke();
  }
}

// One bar for each value between -limit and limit, or from zero where nothing is negative.
export function bars(canvas, values, limit, signed) {
  const [pen, width, height] = prepare(canvas);
  const zero = signed ? height / 2 : height - 2, reach = signed ? height / 2 - 2 : height - 4;
  pen.strokeStyle = AXIS;
  pen.lineWidth = 0.6;
  pen.beginPath();
  pen.moveTo(26, zero);
  pen.lineTo(width, zero);
  pen.stroke();
  pen.fillText(String(limit), 0, zero - reach + 8);
  const step = (width - 26) / values.length;
  pen.fillStyle = BAR;
  values.forEach((value, k) => {
    const length = reach * Math.max(-1, Math.min(1, value / limit));
    pen.fillRect(26 + k * step + 0.1 * step, zero - Math.max(length, 0), 0.8 * step, Math.abs(length));
  });
}
