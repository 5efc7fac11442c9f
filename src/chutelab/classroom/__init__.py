"""What a class needs.

- `lessons`: a question, a worksheet, an exercise, a picture, and scenes to run.
- `exercises`: exercises that answer back, with each student's own numbers.
- `report`: what a run says on two to four pages, or a lab report's skeleton.
- `book`: what a lesson's notebook calls: its machine, its runs.
- `grading`: marks from what students returned, and what a class did.
- `kernel`: their cells, run in a process of their own, with limits.
"""
