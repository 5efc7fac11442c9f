export const clearOf = (room, places) => places.map(() => true);
export const movedOut = (scene, room, releases) => releases;
