// Made of the program's own constants when a page is built.
declare module "shared/bodies/constants.js";

// What pages put where others find it: what drives a page, and the splats that an offline one carries.
interface Window {
  live: Record<string, unknown>;
  viewer: Record<string, unknown>;
  viewerParts: {
    bytes(part: string): Uint8Array;
    text(part: string): Promise<string>;
    buffer(part: string): Promise<ArrayBuffer>;
    has(part: string): boolean;
  };
}
