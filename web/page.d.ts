// What pages put where others find it: what drives a page, and the splats that an offline one carries.
interface Window {
  live: Record<string, unknown>;
  viewer: Record<string, unknown>;
  viewerParts: {
    bytes(part: string): Uint8Array;
    text(part: string): Promise<string>;
    has(part: string): boolean;
  };
}
