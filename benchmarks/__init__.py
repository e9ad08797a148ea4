"""Scores of every controller over fixed scenarios, with the means to run each of them again.

python -m benchmarks run       score all controllers, one JSON a row
python -m benchmarks board     write LEADERBOARD.md, its plot and TIMES.md from the rows
python -m benchmarks verify    run a row again from its own record and compare
python -m benchmarks audit     draw the salt of a row and score it on seeds nobody could know
python -m benchmarks cite      print BibTeX of a row and of the methods in it
python -m benchmarks papers    published figures beside ours
python -m benchmarks speed     measure rates against other environments
python -m benchmarks show      run one episode and draw it
"""
