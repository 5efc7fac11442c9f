export const predict = () => ({ reason: "no-theory" });
