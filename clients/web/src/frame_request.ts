// What the page asks of a view, and how large its pictures are to be.

import { type Report } from "../gen/bounced_pb";
import { type Size } from "./project";
import { type Settings } from "./settings";

export interface FrameInit {
  readonly technique: string;
  readonly parameters: { key: string; value: string }[];
  readonly size: number[];
  readonly layers: string[];
  readonly exposure: string;
  readonly tonemap: string;
  readonly encoding: string;
  readonly jpegQuality: number;
  readonly aa: number;
}

export const SIDE_LEAST_PX = 64;
const SIDE_MOST_PX = 4096;
// While something moves, a frame that takes longer than this is asked for smaller.
const MOVING_MS = 120;
const QUALITY_STILL = 92;
const QUALITY_MOVING = 75;

// 1 or 1/2 of the sides: what brings a frame of `frameMs` at full size nearer to MOVING_MS. Never
// less: what is dragged could not be told from what it stands on.
export const motionScale = (frameMs: number): number => (frameMs > MOVING_MS ? 0.5 : 1);

// What a frame of `size` takes in motion, by what one at hand took; null where that tells nothing of
// it: of another size, or made better than asked for. What is done once, and what smooth edges cost,
// a moving picture does not pay.
export function motionMs(report: Report, step: number, size: readonly number[]): number | null {
  const time = report.timeMs;
  if (!time || step > 0 || report.size.some((side, i) => side !== size[i])) return null;
  return (time.total - time.load - time.compile) / Math.max(1, report.aa);
}

// The picture's size in its own pixels, of the stage's shape.
export function pictureSize(stage: Size, pixelRatio: number, scale: number): number[] {
  const most = SIDE_MOST_PX / (Math.max(stage.width, stage.height) * pixelRatio);
  const least = SIDE_LEAST_PX / (Math.min(stage.width, stage.height) * pixelRatio);
  const factor = pixelRatio * Math.min(most, Math.max(scale, least));
  const side = (css: number) => Math.max(SIDE_LEAST_PX, Math.min(SIDE_MOST_PX, Math.round(css * factor)));
  return [side(stage.width), side(stage.height)];
}

export interface Moment {
  readonly size: number[];
  readonly isMoving: boolean;
}

export function frameRequest(settings: Settings, moment: Moment): FrameInit {
  const parameters = Object.entries(settings.parameters[settings.technique] ?? {});
  return {
    technique: settings.technique,
    parameters: parameters.map(([key, value]) => ({ key, value })),
    size: moment.size,
    layers: [settings.layer === "error" ? "beauty" : settings.layer], // error_map.ts makes it of that
    exposure: settings.exposure,
    tonemap: settings.tonemap,
    encoding: "jpeg",
    jpegQuality: moment.isMoving ? QUALITY_MOVING : QUALITY_STILL,
    aa: moment.isMoving ? 1 : Number(settings.aa) || 1,
  };
}
