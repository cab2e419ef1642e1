// SPDX-License-Identifier: GPL-3.0-or-later
// The grid of map tiles: Web Mercator, numbered from the north-west corner of the world; its side has 2^zoom tiles.

export const TILE_PX = 256;
const EQUATOR_M = 40075016.686, MOST_LAT = 85.051128; // there the square ends

// In tiles, with fractions.
export const columnOf = (lon, zoom) => ((lon + 180) / 360) * 2 ** zoom;
export const rowOf = (lat, zoom) => (0.5 - Math.asinh(Math.tan((clamp(lat) * Math.PI) / 180)) / (2 * Math.PI)) * 2 ** zoom;
export const lonOf = (column, zoom) => (column / 2 ** zoom) * 360 - 180;
export const latOf = (row, zoom) => (Math.atan(Math.sinh((0.5 - row / 2 ** zoom) * 2 * Math.PI)) * 180) / Math.PI;

// The zoom whose tiles are drawn nearest to their own size.
export function zoomFor(pixelsPerMetre, lat, finest) {
  const tile_m = TILE_PX / pixelsPerMetre, around_m = EQUATOR_M * Math.cos((clamp(lat) * Math.PI) / 180);
  return Math.min(Math.max(Math.round(Math.log2(around_m / tile_m)), 0), finest);
}

const clamp = (lat) => Math.min(Math.max(lat, -MOST_LAT), MOST_LAT);
