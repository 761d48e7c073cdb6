// Sources and alarms as bands below the trends, faults as upright lines through them, and limits as level ones. Each source has a pattern as well as a colour.

import { shorten } from "/element.js";
import { heightOf } from "/lanes.js";

const PATTERNS = { direct: "plain", reconstructed: "slanted", held: "dots", "fail-safe": "filled", alarm: "slanted" };
const COLORS = { alarm: "--warn" };

export function bandPlugin(answer, color) {
  return {
    hooks: {
      drawClear: (plot) => {
        const { ctx, bbox } = plot;
        const x = (cycle) => Math.min(Math.max(plot.valToPos(cycle, "x", true), bbox.left), bbox.left + bbox.width);
        ctx.save();
        answer.sources.forEach((band, row) => {
          const top = plot.valToPos(-0.35 - row * 0.7, "y", true);
          const bottom = plot.valToPos(-0.35 - row * 0.7 - 0.5, "y", true);
          for (const [from, to, source] of band.runs) {
            stripe(ctx, x(from), top, x(to + 1), bottom, PATTERNS[source] ?? "none", color(COLORS[source] ?? `--source-${source}`) || color("--line"));
          }
          ctx.fillStyle = color("--ink");
          ctx.font = `${11 * devicePixelRatio}px system-ui, sans-serif`;
          ctx.textAlign = "right";
          ctx.fillText(shorten(band.name, 18), bbox.left - 8 * devicePixelRatio, (top + bottom) / 2 + 4 * devicePixelRatio);
        });
        ctx.restore();
      },
      draw: (plot) => {
        const { ctx, bbox } = plot;
        ctx.save();
        ctx.strokeStyle = color("--ink");
        ctx.fillStyle = color("--ink");
        ctx.font = `${11 * devicePixelRatio}px system-ui, sans-serif`;
        ctx.textAlign = "left";
        ctx.setLineDash([5, 4]);
        // Words stand in the first row that is free; where none is, the line stands alone.
        const free = [0, 0, 0];
        answer.faults.forEach((fault) => {
          const at = plot.valToPos(fault.cycle, "x", true);
          if (at < bbox.left || at > bbox.left + bbox.width) {
            return;
          }
          ctx.beginPath();
          ctx.moveTo(at, bbox.top);
          ctx.lineTo(at, bbox.top + bbox.height);
          ctx.stroke();
          const words = shorten(fault.words, Math.min(34, Math.floor(bbox.width / (7 * devicePixelRatio))));
          const width = ctx.measureText(words).width + 8 * devicePixelRatio;
          const left = Math.min(at + 4, bbox.left + bbox.width - width);
          const row = free.findIndex((end) => end <= left);
          if (row >= 0) {
            free[row] = left + width;
            ctx.fillText(words, left, bbox.top + (12 + row * 13) * devicePixelRatio);
          }
        });
        ctx.restore();
      },
    },
  };
}

// Limits of alarms as dashed lines in the lanes of their signals.
export function limitPlugin(lanes, color) {
  return {
    hooks: {
      draw: (plot) => {
        const { ctx, bbox } = plot;
        ctx.save();
        ctx.strokeStyle = color("--warn");
        ctx.lineWidth = devicePixelRatio;
        ctx.setLineDash([8 * devicePixelRatio, 5 * devicePixelRatio]);
        for (const lane of lanes) {
          for (const limit of lane.limits) {
            const at = plot.valToPos(heightOf(lane, limit), "y", true);
            ctx.beginPath();
            ctx.moveTo(bbox.left, at);
            ctx.lineTo(bbox.left + bbox.width, at);
            ctx.stroke();
          }
        }
        ctx.restore();
      },
    },
  };
}

function stripe(ctx, left, top, right, bottom, pattern, color) {
  const width = Math.max(right - left, 1);
  ctx.save();
  ctx.beginPath();
  ctx.rect(left, top, width, bottom - top);
  ctx.clip();
  ctx.fillStyle = color;
  ctx.strokeStyle = color;
  ctx.globalAlpha = pattern === "filled" ? 1 : 0.25;
  ctx.fillRect(left, top, width, bottom - top);
  ctx.globalAlpha = 1;
  const step = 7 * devicePixelRatio;
  if (pattern === "slanted") {
    ctx.lineWidth = 2 * devicePixelRatio;
    for (let x = left - (bottom - top); x < right; x += step) {
      ctx.beginPath();
      ctx.moveTo(x, bottom);
      ctx.lineTo(x + (bottom - top), top);
      ctx.stroke();
    }
  } else if (pattern === "dots") {
    for (let x = left + step / 2; x < right; x += step) {
      ctx.fillRect(x, (top + bottom) / 2 - devicePixelRatio, 2 * devicePixelRatio, 2 * devicePixelRatio);
    }
  }
  ctx.restore();
}
