"""Scores of every controller over fixed scenarios, with the means to compute each of them again.

python -m benchmarks run        score controllers, one compressed file a row
python -m benchmarks board      write LEADERBOARD.md and its pages from the rows
python -m benchmarks show-row   print a row
python -m benchmarks site       write an interactive page of the rows
python -m benchmarks verify     compute a row again and compare
python -m benchmarks audit      draw the salt of a track's round and score its controllers
python -m benchmarks cite       print BibTeX of a row and of the methods in it
python -m benchmarks tune       search the knobs of a controller
python -m benchmarks papers     published figures beside ours
python -m benchmarks speed      measure rates against other environments
python -m benchmarks diagnosis  diagnose simulated rigs with hidden effects
python -m benchmarks show       run one episode and draw it
"""
