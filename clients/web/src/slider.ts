// Ranges that span decades on a slider of even steps.

export const STEPS = 1000;

export interface Range {
  readonly minimum: number;
  readonly maximum: number;
  readonly isWhole: boolean;
}

// The smallest number above 0 that the slider still tells from it.
const leastOf = (range: Range): number =>
  range.minimum > 0 ? range.minimum : range.isWhole ? 1 : Math.min(1e-3, range.maximum / 1000);

const isLogarithmic = (range: Range): boolean => range.maximum > 50 * Math.max(range.minimum, 1);

export const hasSlider = ({ minimum, maximum }: Range): boolean =>
  Number.isFinite(minimum) && Number.isFinite(maximum) && minimum >= 0 && maximum > minimum;

export function toStep(range: Range, value: number): number {
  const { minimum, maximum } = range;
  const inside = Math.min(maximum, Math.max(minimum, value));
  if (!isLogarithmic(range)) return Math.round((STEPS * (inside - minimum)) / (maximum - minimum));
  const least = leastOf(range);
  if (inside < least) return 0;
  return Math.round(1 + ((STEPS - 1) * Math.log(inside / least)) / Math.log(maximum / least));
}

export function fromStep(range: Range, step: number): number {
  const { minimum, maximum, isWhole } = range;
  const least = leastOf(range);
  const share = isLogarithmic(range) ? (step - 1) / (STEPS - 1) : step / STEPS;
  const value = isLogarithmic(range)
    ? step === 0 ? minimum : least * (maximum / least) ** share
    : minimum + share * (maximum - minimum);
  const rounded = isWhole ? Math.round(value) : Number(value.toPrecision(2));
  return Math.min(maximum, Math.max(minimum, rounded));
}
